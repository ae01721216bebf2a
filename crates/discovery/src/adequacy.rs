//! Is the chosen model enough? Tests for what it leaves, each family with its own level.

use crate::addition::{Addition, labels};
use crate::candidates::laws;
use crate::fit::{ChosenRecords, Fit};
use crate::judged::Judged;
use crate::linear::Square;
use crate::periodicity;
use crate::residuals::left;
use crate::result::Tests;
use crate::scattered::Scattered;
use crate::score::{differences, heterogeneity, scores};
use crate::scored::Score;
use crate::search::{Search, resolution};
use crate::statistics::{chi2_tail, median};
use augsim_physics::system::ScatterPer;
use rayon::prelude::*;

/// P-value of smooth shapes in the arcs below which a lack of fit is left.
const LEVEL_OF_FIT: f64 = 1e-4;
/// P-value of the best score below which an effect of the library is left.
const LEVEL_OF_LIBRARY: f64 = 1e-3;
/// P-value of the best law of one feature below which a law is left.
const LEVEL_OF_LAWS: f64 = 1e-4;
/// The same beside a scatter, which absorbs most of what a law shows.
const LEVEL_OF_LAWS_BESIDE_SCATTER: f64 = 0.02;
/// P-value below which parameters differ from record to record.
const LEVEL_OF_HETEROGENEITY: f64 = 1e-4;
/// P-value below which the scatter of events has a period on the clock.
const LEVEL_OF_PERIODICITY: f64 = 1e-3;
/// Gain in -2 ln likelihood by a scatter from which on one is left.
const MOST_SCATTER_GAIN: f64 = 15.8;

/// P-value below which so much is left that the model is no explanation, even without a better one.
const SEVERE: f64 = 1e-6;
/// The same of a law beside a scatter, which absorbs most of what a law shows.
const SEVERE_BESIDE_SCATTER: f64 = 1e-4;
/// Gain by a scatter from which on it is severe that the model has none.
const SEVERE_SCATTER_GAIN: f64 = 42.0;

/// P-values of the families of tests, each multiplied by the number of tests in it.
#[derive(Clone, Debug)]
pub(crate) struct Adequacy {
    /// Low-order shapes left in the arcs.
    pub lack_of_fit: f64,
    /// Library effects that are not in the model.
    pub library: f64,
    /// Laws of one feature.
    pub laws: f64,
    /// Parameters that differ from trajectory to trajectory.
    pub heterogeneity: f64,
    /// Periodicity of the scatter on the clock.
    pub periodicity: f64,
    /// Gain in -2 ln likelihood if the parameter of the events may scatter.
    pub scatter_gain: f64,
    /// The model has scatter, which can absorb a law that depends on a feature of the trajectory.
    pub scatters: bool,
    /// The system has targets that laws of one feature may add to.
    pub has_laws: bool,
    /// The system has events.
    pub has_events: bool,
    /// Scores of the one-feature laws.
    pub law_scores: Vec<Score>,
}

impl Adequacy {
    /// Nothing is left that the tests can see.
    pub fn ok(&self) -> bool {
        let laws = if self.scatters { LEVEL_OF_LAWS_BESIDE_SCATTER } else { LEVEL_OF_LAWS };
        self.lack_of_fit > LEVEL_OF_FIT
            && self.library > LEVEL_OF_LIBRARY
            && self.laws > laws
            && self.heterogeneity > LEVEL_OF_HETEROGENEITY
            && self.periodicity > LEVEL_OF_PERIODICITY
            && self.scatter_gain < MOST_SCATTER_GAIN
    }

    /// The tests in the form of the result.
    pub fn tests(&self) -> Tests {
        Tests {
            lack_of_fit: self.lack_of_fit,
            library: self.library,
            laws: self.has_laws.then_some(self.laws),
            heterogeneity: self.heterogeneity,
            periodicity: self.has_events.then_some(self.periodicity),
            pass: self.ok(),
        }
    }

    /// So much is left that the model cannot be called an explanation, even without a better one.
    pub fn severe(&self) -> bool {
        let p = [self.lack_of_fit, self.library, self.heterogeneity, self.periodicity];
        let laws = if self.scatters { SEVERE_BESIDE_SCATTER } else { SEVERE };
        p.iter().any(|p| *p < SEVERE) || self.laws < laws || self.scatter_gain > SEVERE_SCATTER_GAIN
    }
}

/// Tests what a fit leaves on the training part.
///
/// Where the system's laws are idealisations, something smooth is always left: the misfit is then compared with the noise as a
/// whole, p-values are corrected by the dispersion, and what of `tried` was fitted beside the model and did not pay is no
/// longer tested by its score. Where parameters are drawn anew for each record, what is left at the `own` values of the records
/// counts.
pub(crate) fn adequacy(
    search: &Search<'_>,
    judged: &Judged,
    tried: &[Judged],
    own: Option<&Scattered>,
) -> Adequacy {
    let (sample, fit) = (&search.train, &judged.fit);
    let schema = sample.data.system.schema();
    let resolution = resolution(sample);
    let idealised = sample.data.is_idealised();
    let bonferroni = |list: &[Score]| {
        let worst = list.iter().filter(|s| s.rank > 0.0).map(|s| s.tail(resolution)).fold(1.0, f64::min);
        // Without a test nothing speaks against the fit.
        (worst * list.len().max(1) as f64).min(1.0)
    };
    let candidates = laws(sample.data, &fit.events);
    let law_scores = scores(sample, fit, &candidates);
    let mut library = search.library_scores(judged);
    if idealised {
        let tried: Vec<Vec<String>> = tried.iter().map(|j| labels(j.additions())).collect();
        library.retain(|s| !tried.contains(&labels_with(judged, &s.addition)));
    } else if sample.data.system.begins_from_first_samples() {
        library.iter_mut().for_each(|score| score.statistic = realised(score, judged, tried));
    }
    let misfits: Vec<[f64; 2]> = match own {
        Some(own) => own.normals.iter().map(|n| [n.misfit, n.freedom]).collect(),
        None => fit.misfits.clone(),
    };
    let excess = if idealised { excess(&misfits) } else { 0.0 };
    // The misfit that all records share is no difference between them, nor is what the noise's variance may be off by.
    let level = if idealised { (1.0 + excess).max(1.0) + 2.0 * NOISE_UNCERTAINTY } else { 1.0 };
    let varied = match own {
        Some(own) => differences(sample, &own.parts),
        None => heterogeneity(sample, fit),
    };
    let tested = varied.iter().filter(|(_, df)| *df > 0.0).count() as f64;
    let heterogeneity = varied
        .iter()
        .filter(|(_, df)| *df > 0.0)
        .map(|(q, df)| chi2_tail(*q / level, *df))
        .fold(1.0, f64::min)
        * tested;
    let scatter = fit.hypothesis.scatter.is_some();
    let scatter_gain = if !scatter && search.events_vary(fit, 0.01) {
        let mut with = fit.hypothesis.additions.clone();
        with.extend(Addition::scatter(&*sample.data.system, ScatterPer::Event));
        2.0 * (search.refit(fit, &with, &[]).fit.ll - fit.ll)
    } else {
        0.0
    };
    Adequacy {
        lack_of_fit: if idealised { too_much(&misfits, excess) } else { lack_of_fit(sample, fit) },
        library: bonferroni(&library),
        laws: bonferroni(&law_scores),
        heterogeneity: heterogeneity.min(1.0),
        periodicity: if scatter { periodicity::p_value(sample, fit) } else { 1.0 },
        scatter_gain,
        scatters: scatter,
        has_laws: !schema.targets.is_empty(),
        has_events: schema.event.is_some(),
        law_scores,
    }
}

/// Labels of a set with one addition more.
fn labels_with(judged: &Judged, addition: &Addition) -> Vec<String> {
    labels(&[judged.additions(), std::slice::from_ref(addition)].concat())
}

/// Statistic of an addition's score, or what a fit with it gained where that is less. Where windows begin at guessed starts, and events
/// come and go with them, the cost is no parabola, and a slope promises what no step keeps.
fn realised(score: &Score, judged: &Judged, tried: &[Judged]) -> f64 {
    let with = labels_with(judged, &score.addition);
    let fitted = tried.iter().filter(|j| labels(j.additions()) == with);
    let most = fitted.map(|j| 2.0 * (j.fit.ll - judged.fit.ll)).reduce(f64::max);
    most.map_or(score.statistic, |gained| score.statistic.min(gained.max(0.0)))
}

/// Relative standard error of the estimated noise variance: a misfit within it is no misfit.
const NOISE_UNCERTAINTY: f64 = 0.03;

/// By how much the typical misfit of a window exceeds the noise, in units of it.
fn excess(misfits: &[[f64; 2]]) -> f64 {
    let mut ratios: Vec<f64> = misfits.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    median(&mut ratios) - 1.0
}

/// P-value of an excess of the misfit over the noise.
fn too_much(misfits: &[[f64; 2]], excess: f64) -> f64 {
    let freedom: f64 = misfits.iter().map(|[_, freedom]| freedom).sum::<f64>().max(1.0);
    let z = excess / (NOISE_UNCERTAINTY + (4.0 / freedom).sqrt());
    // Chi-squared of z² with one degree of freedom is the two-sided tail of the normal law.
    if z > 0.0 { chi2_tail(z * z, 1.0) } else { 1.0 }
}

/// Most that one arc and channel may add to the misfit of smooth shapes: with four terms noise passes it once in a million arcs.
/// A law that a model lacks shows in many arcs; an outlier that was not masked shows in one.
const MOST_OF_AN_ARC: f64 = 33.4;

/// The part of an arc's misfit that counts.
fn counted(squares: f64) -> f64 {
    squares.min(MOST_OF_AN_ARC)
}

fn lack_of_fit(sample: &ChosenRecords<'_>, fit: &Fit) -> f64 {
    const TERMS: usize = 4;
    let rho = sample.correlation;
    let innovation = 1.0 / (1.0 - rho * rho).sqrt();
    let parts: Vec<(f64, f64)> = left(sample, fit)
        .into_par_iter()
        .zip(sample.chosen)
        .map(|(left, &j)| {
            let record = &sample.data.records[j];
            let (mut sum, mut count) = (0.0, 0.0);
            for arc in &record.seen.pieces {
                for (c, r) in left.residuals.iter().enumerate() {
                    let used: Vec<usize> = arc.clone().filter(|&k| r[k].is_finite()).collect();
                    if used.len() < 2 * TERMS {
                        continue;
                    }
                    let (a, b) = (record.seen.times[used[0]], record.seen.times[used[used.len() - 1]]);
                    let row = |k: usize| {
                        let u = 2.0 * (record.seen.times[k] - a) / (b - a) - 1.0;
                        let w = record.weight[c][k];
                        [w, w * u, w * (1.5 * u * u - 0.5), w * (2.5 * u * u - 1.5) * u, w * r[k]]
                    };
                    let mut h = Square::zero(TERMS);
                    let mut g = [0.0; TERMS];
                    for (n, &k) in used.iter().enumerate() {
                        let mut x = row(k);
                        if rho != 0.0 && n > 0 && record.seen.follows(used[n - 1], k) {
                            let before = row(used[n - 1]);
                            (0..=TERMS).for_each(|m| x[m] = (x[m] - rho * before[m]) * innovation);
                        }
                        for m in 0..TERMS {
                            g[m] += x[m] * x[TERMS];
                            (0..TERMS).for_each(|l| *h.at_mut(m, l) += x[m] * x[l]);
                        }
                    }
                    h.cholesky().forward(&mut g);
                    sum += counted(g.iter().map(|v| v * v).sum());
                    count += TERMS as f64;
                }
            }
            (sum, count - left.nuisances as f64)
        })
        .collect();
    let (sum, freedom) = parts.iter().fold((0.0, 0.0), |a, p| (a.0 + p.0, a.1 + p.1));
    let freedom = freedom - fit.theta.len() as f64;
    if freedom < 1.0 { 1.0 } else { chi2_tail(sum, freedom) }
}

#[cfg(test)]
mod tests {
    //! Contract: a law that the model lacks shows as lack of fit through several arcs; one arc that an outlier spoils does not. A
    //! law that is left beside a scatter is severe earlier than one that is left beside none.
    use super::*;

    #[test]
    fn a_law_beside_a_scatter_is_severe_at_odds_of_ten_thousand_to_one() {
        let left = |laws, scatters| Adequacy {
            lack_of_fit: 1.0,
            library: 1.0,
            laws,
            heterogeneity: 1.0,
            periodicity: 1.0,
            scatter_gain: 0.0,
            scatters,
            has_laws: true,
            has_events: true,
            law_scores: Vec::new(),
        };
        assert!(left(1e-5, true).severe() && !left(1e-5, false).severe());
        assert!(!left(1e-3, true).severe() && left(1e-7, false).severe());
    }

    /// P-value of 16 arcs with four shapes each, of which the first ones have these misfits and the others what noise leaves.
    fn of_arcs(spoilt: &[f64]) -> f64 {
        let noise = [4.0].into_iter().cycle().take(16 - spoilt.len());
        chi2_tail(spoilt.iter().copied().chain(noise).map(counted).sum(), 64.0)
    }

    #[test]
    fn one_spoilt_arc_is_no_lack_of_fit_and_three_are() {
        assert!(of_arcs(&[]) > 0.4);
        assert!(of_arcs(&[1e6]) > 1e-4, "{:e}", of_arcs(&[1e6]));
        assert!(of_arcs(&[33.0; 3]) < 1e-6, "{:e}", of_arcs(&[33.0; 3]));
    }
}
