//! Score of a candidate experiment: expected log odds between explanations, or information on parameters.
//!
//! For truth i with parameters drawn from its distribution, rival j, and the difference Δ of their predictions,
//!
//! ```text
//! (1)  D_ij = 1/2 min over δ of |R^{-1/2} (Δ - S_j δ)|² + 1/2 |δ|²
//! ```
//!
//! is the expected log odds for i from one run, in nats: the part of the difference that the rival cannot absorb by other
//! parameters and another initial state (T-optimality, Atkinson and Fedorov 1975; with prior information, Ponce de Leon and
//! Atkinson 1991). R is the covariance of measurement and process noise. A rival is held to half of the earlier data, as in the
//! judgement of `evidence.rs`; readings of the first samples are divided out as there. The log odds of a run are about normal with
//! mean D and variance 2 D. The score is
//!
//! ```text
//! (2)  sum over i ≠ j of w_i w_j mean over draws of c (1 - exp(-(A_ij + D_ij) / c))
//! ```
//!
//! with the log odds A_ij of the runs that are already planned, and c the mean from which nine of ten runs reach the
//! required odds: a pair that is already separated counts no more. A single explanation is scored by its expected
//! information gain, half the log of the ratio of the determinants of its covariance before and after (D-optimality).
//!
//! Formula (1) is linear in the rival's parameters; the best candidates are scored again by the judgement of recordings without
//! noise, `noise_free.rs`.

use crate::candidate::{Candidate, Experiment};
use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::limits::Limits;
use crate::linearise::{Start, start_readings};
use crate::projection::Projection;
use crate::whiten::whiten;
use augsim_system::{Record, Simulated, shortest_difference};

/// Factors by which inputs are reduced, in turn, until all explanations stay within the limits.
const SCALES: [f64; 10] = [1.0, 0.75, 0.55, 0.4, 0.3, 0.2, 0.13, 0.08, 0.04, 0.02];
/// Quantile of the normal distribution that nine of ten values exceed, with the sign changed.
const NORMAL_90: f64 = 1.281_551_565_544_6;

/// Explanations, limits and drawn parameters with which candidates are scored.
pub(crate) struct Study<'a> {
    pub explanations: &'a [Explanation],
    pub limits: &'a Limits,
    /// Normalised weights of the explanations.
    pub weights: Vec<f64>,
    /// Drawn parameter values of each explanation, `[explanation][draw]`; the first are the fitted values.
    pub draws: Vec<Vec<Vec<f64>>>,
    /// Mean log odds c of formula (2), nats.
    pub sufficient: f64,
}

/// A candidate that keeps all explanations within the limits, with its scores.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub candidate: Candidate,
    /// Factor of the inputs' deviations from rest.
    pub scale: f64,
    pub experiment: Experiment,
    /// Expected log odds D of formula (1), nats, `[truth][rival][draw]`; empty lists on the diagonal.
    pub log_odds: Vec<Vec<Vec<f64>>>,
    /// As `log_odds`, without a refit of the rival, for the fitted values.
    pub without_refit: Vec<Vec<f64>>,
    /// Information gain on the parameters of each explanation, nats.
    pub information: Vec<f64>,
    /// The explanations with the covariance that the run leaves.
    pub after: Vec<Explanation>,
    /// Name of the limit that made the inputs smaller; `None` if none did.
    pub limited_by: Option<String>,
}

/// Mean of a log likelihood ratio that exceeds `required` nats in nine of ten runs, if its variance is twice its mean.
pub(crate) fn sufficient_mean(required: f64) -> f64 {
    // Solves m - z sqrt(2 m) = required.
    let root = (NORMAL_90 + (NORMAL_90 * NORMAL_90 + 2.0 * required).sqrt()) / std::f64::consts::SQRT_2;
    root * root
}

impl Study<'_> {
    /// Scores a candidate; `None` if no amplitude keeps all explanations within the limits.
    pub fn score(&self, candidate: &Candidate) -> Option<Scored> {
        let mut limited_by = None;
        for scale in SCALES {
            let experiment = candidate.experiment(self.limits, scale);
            match self.runs(&experiment) {
                Ok(runs) => return self.scored(candidate, scale, experiment, &runs, limited_by),
                Err(limit) => limited_by = limited_by.or(Some(limit)),
            }
        }
        None
    }

    /// Scores a candidate with its inputs multiplied by `scale`; `None` if an explanation exceeds a limit.
    pub fn score_at(&self, candidate: &Candidate, scale: f64, limited_by: Option<String>) -> Option<Scored> {
        let experiment = candidate.experiment(self.limits, scale);
        let runs = self.runs(&experiment).ok()?;
        self.scored(candidate, scale, experiment, &runs, limited_by)
    }

    /// Scores an experiment as it is; `None` if an explanation cannot be simulated or exceeds a limit.
    pub fn score_experiment(&self, experiment: &Experiment) -> Option<Scored> {
        let runs = self.runs(experiment).ok()?;
        let nothing = Candidate { inputs: Vec::new(), starts: Vec::new() };
        self.scored(&nothing, 1.0, experiment.clone(), &runs, None)
    }

    /// Simulates all draws of all explanations; the error names the limit that one of them exceeds.
    fn runs(&self, experiment: &Experiment) -> Result<Vec<Prepared>, String> {
        let record = experiment.record("design");
        let mut all = Vec::with_capacity(self.explanations.len());
        for (e, draws) in self.explanations.iter().zip(&self.draws) {
            let unusable = |_: DesignError| "an explanation that cannot be simulated".to_owned();
            let prepared = e.prepare(&record).map_err(unusable)?;
            let rough = prepared.windows.first().map_or(&[][..], |w| &w.start);
            let start = experiment.start_of(e, rough);
            let runs = e.simulate_draws(&prepared, draws, &start).map_err(unusable)?;
            if let Some(limit) = runs.iter().find_map(|out| exceeded(e, self.limits, out)) {
                return Err(limit);
            }
            all.push(Prepared { record: prepared, start, runs });
        }
        Ok(all)
    }

    fn scored(
        &self,
        candidate: &Candidate,
        scale: f64,
        experiment: Experiment,
        prepared: &[Prepared],
        limited_by: Option<String>,
    ) -> Option<Scored> {
        let count = self.explanations.len();
        let mut scored = Scored {
            candidate: candidate.clone(),
            scale,
            experiment,
            log_odds: vec![vec![Vec::new(); count]; count],
            without_refit: vec![vec![0.0; count]; count],
            information: vec![0.0; count],
            after: Vec::with_capacity(count),
            limited_by,
        };
        for (j, rival) in self.explanations.iter().enumerate() {
            let truths: Vec<usize> = (0..count).filter(|i| *i != j).collect();
            let compared =
                compare(rival, &prepared[j], &truths.iter().map(|i| &prepared[*i]).collect::<Vec<_>>())
                    .ok()?;
            for (i, (odds, raw)) in truths.iter().zip(compared.log_odds) {
                (scored.log_odds[*i][j], scored.without_refit[*i][j]) = (odds, raw);
            }
            scored.information[j] = compared.information;
            scored.after.push(compared.after);
        }
        Some(scored)
    }

    /// Score (2) of a candidate beside runs with the expected log odds `planned`, `[truth][rival]`.
    pub fn value(&self, scored: &Scored, planned: &[Vec<f64>]) -> f64 {
        if self.explanations.len() == 1 {
            return scored.information[0];
        }
        let mut sum = 0.0;
        for (i, row) in scored.log_odds.iter().enumerate() {
            for (j, draws) in row.iter().enumerate().filter(|(j, _)| *j != i) {
                let saturated =
                    |d: &f64| self.sufficient * (1.0 - (-(planned[i][j] + d) / self.sufficient).exp());
                let mean = draws.iter().map(saturated).sum::<f64>() / draws.len().max(1) as f64;
                sum += self.weights[i] * self.weights[j] * mean;
            }
        }
        sum
    }
}

/// A prepared record of an experiment with the planned start, and the runs of all draws.
struct Prepared {
    record: Record,
    start: Vec<f64>,
    runs: Vec<Simulated>,
}

/// Comparison of a rival with several truths.
struct Compared {
    /// For each truth: expected log odds of each draw, and that of the fitted values without a refit.
    log_odds: Vec<(Vec<f64>, f64)>,
    information: f64,
    after: Explanation,
}

/// Computes formula (1) for a rival and several truths.
fn compare(rival: &Explanation, own: &Prepared, truths: &[&Prepared]) -> Result<Compared, DesignError> {
    let (_, mut start) = rival.opened(&own.record, Some(&own.start))?;
    start = Start { mean: own.start.clone(), ..start };
    let out = rival.simulate(&own.record, &rival.values, &own.start, &rival.seeds(&start))?;
    let runs: Vec<&Simulated> = truths.iter().flat_map(|t| &t.runs).collect();
    let channels = &rival.system.schema().channels;
    let difference = |sample: usize, output: usize, target: usize| match runs.get(target) {
        Some(run) => shortest_difference(
            run.value(sample, output) - out.value(sample, output),
            channels[output].period,
        ),
        None => 0.0,
    };
    let targets = runs.len().max(1);
    let mut columns = rival.columns((&out, &rival.values), &start, targets, difference);
    let parameters = targets..targets + rival.uncertain.len();
    let intervals = rival.intervals(&own.record, &rival.values, &out)?;
    whiten(&rival.noise, &own.record.times, &mut columns, &intervals);
    let rows = columns.readings.len();
    let first_rows = start_readings(rival, &columns, &start);
    let not_finite = || DesignError::NotFinite { name: rival.name.clone(), record: own.record.id.clone() };
    let after = Projection::new(&columns, targets, rows).ok_or_else(not_finite)?;
    let after = rival.after(&after.inverse, &vec![0.0; rival.uncertain.len()]);
    // The prior |δ|² with the weight 1/2 is that of columns that are longer by the square root of 2.
    for row in columns.values.chunks_exact_mut(columns.count) {
        row[parameters.clone()].iter_mut().for_each(|w| *w *= std::f64::consts::SQRT_2);
    }
    let all = Projection::new(&columns, targets, rows).ok_or_else(not_finite)?;
    let first = Projection::new(&columns, targets, first_rows).ok_or_else(not_finite)?;
    let zero = vec![0.0; columns.count - targets];
    let mut target = 0;
    let mut log_odds = Vec::with_capacity(truths.len());
    for truth in truths {
        let raw = 0.5 * (all.squares[target] - first.squares[target]);
        let expected = |t: usize| 0.5 * (all.minimum(t, &zero) - first.minimum(t, &zero)).max(0.0);
        log_odds.push(((target..target + truth.runs.len()).map(expected).collect(), raw));
        target += truth.runs.len();
    }
    let half_log = |e: &Explanation| {
        (0..e.factor.len()).map(|i| e.factor[i][i].max(f64::MIN_POSITIVE).ln()).sum::<f64>()
    };
    Ok(Compared { log_odds, information: half_log(rival) - half_log(&after), after })
}

/// Name of the first limit of outputs and states that a run exceeds; `None` if it exceeds none.
pub(crate) fn exceeded(e: &Explanation, limits: &Limits, out: &Simulated) -> Option<String> {
    e.channels().enumerate().find_map(|(channel, name)| {
        let [low, high] = limits.ranges.get(name)?;
        let is_inside = |k: usize| (*low..=*high).contains(&out.value(k, channel));
        (!(0..out.samples()).all(is_inside)).then(|| name.to_owned())
    })
}

#[cfg(test)]
mod tests {
    //! Contract: the sufficient mean solves its equation.
    use super::*;

    #[test]
    fn nine_of_ten_runs_with_the_sufficient_mean_reach_the_required_odds() {
        for required in [1.0, 1000.0_f64.ln(), 20.0] {
            let mean = sufficient_mean(required);
            assert!((mean - NORMAL_90 * (2.0 * mean).sqrt() - required).abs() < 1e-9);
        }
    }
}
