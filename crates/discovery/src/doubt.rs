//! When the data are not those of the declared system: values that cannot be, bounds that were reached, additions that help no
//! forecast.

use crate::addition::{Addition, labels};
use crate::adequacy::adequacy;
use crate::decide::{Decided, JudgedBy};
use crate::explore::Explored;
use crate::fit::Fit;
use crate::hypothesis::Hypothesis;
use crate::prepare::Prepared;
use crate::result::{ErrorTable, Verdict};
use crate::search::Search;
use crate::statistics::median;
use augsim_physics::model::Per;
use augsim_physics::system::{Record, spread};

/// Share of a parameter's range within which it stands at a bound.
const AT_BOUND: f64 = 1e-6;
/// Errors of the augmented model, in units of the noise floor, from which it does not follow the data.
const FAR: f64 = 2.0;
/// Errors of the calibrated model's forecasts, in what the data do, up to which the data are of the declared system, though it lacks
/// something: a mean of the data would err twice as much.
const ROUGHLY: f64 = 0.5;
/// Ratio of two free runs' errors below which additions help, however few held-out parts there are to compare forecasts on.
const HELPED: f64 = 0.8;

/// Values of all parameters of the system after a fit; of those with values by group the mean.
pub(crate) fn values(fit: &Fit) -> Vec<f64> {
    let h = &fit.hypothesis;
    let mut all = h.values.clone();
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        if width > 0 {
            all[f.index] = fit.theta[at..at + width].iter().sum::<f64>() / width as f64;
        }
        at += width;
    }
    all
}

/// Why the data are not of the declared system, before anything is fitted.
pub(crate) fn before_search(prepared: &Prepared) -> Option<String> {
    let data = &prepared.data;
    data.system.unlike(&data.seen(), &prepared.noise.sd).map(|objection| objection.to_string())
}

/// A doubt that the best model leaves.
pub(crate) enum Doubt {
    /// The data are not of the declared system, in words.
    NotThisSystem(String),
    /// The calibrated model forecasts most of what the data do, and nothing that was found makes its forecasts better.
    NothingHelps,
}

/// The doubt that the best model leaves; `errors` are the tables of all measures, that which decides first.
pub(crate) fn after_search(search: &Search<'_>, decided: &Decided, errors: &[&ErrorTable]) -> Option<Doubt> {
    let fit = &decided.best.fit;
    let h = &fit.hypothesis;
    if let Some(objection) = h.system.implausible(&values(fit)) {
        return Some(Doubt::NotThisSystem(objection.to_string()));
    }
    // A law that nobody described can stand for a value beyond the bound: what counts is the model without it.
    let listed: Vec<Addition> =
        h.additions.iter().filter(|a| !matches!(a, Addition::Table(_))).cloned().collect();
    let before = (listed.len() < h.additions.len()).then(|| labels(&listed));
    let before = before.and_then(|key| decided.found.tried.iter().find(|j| labels(j.additions()) == key));
    let at_bound =
        at_bound(h, &fit.theta).or_else(|| before.and_then(|j| at_bound(&j.fit.hypothesis, &j.fit.theta)));
    if let Some((name, bound)) = at_bound {
        return Some(Doubt::NotThisSystem(format!(
            "`{name}` comes out at its bound of {bound}: widen the bound in the model file if such a value can be, otherwise \
             check units, signs and what was measured"
        )));
    }
    // Idealised laws are always far from the noise, and few records then show no gain. What is drawn anew for each record is in
    // no forecast, and not in its floor either; what shakes a motion is in no forecast.
    let is_exact = (0..h.system.schema().channels.len()).all(|channel| h.system.resolution(channel) == 0.0);
    let claims = matches!(decided.verdict, Verdict::Explained | Verdict::PartlyExplained)
        && decided.scattered.is_none()
        && decided.judged_by == JudgedBy::Windows
        && is_exact;
    let runs_better =
        decided.best.free_run.zip(decided.base.free_run).is_some_and(|(best, base)| best < HELPED * base);
    let helps = runs_better || errors.iter().any(|error| error.reduction.ci95[0] > 0.0);
    let far = errors.iter().any(|error| error.augmented.rmse > FAR * error.noise_floor.rmse);
    // Unstable motion is not forecast from a few samples, however well its laws are known.
    if claims
        && far
        && !helps
        && !follows(&search.heldout(&decided.best).misfits)
        && let Some(error) = errors.first()
    {
        if is_roughly_right(search, error) {
            return Some(Doubt::NothingHelps);
        }
        let (unit, scale) = h.system.schema().decides();
        return Some(Doubt::NotThisSystem(format!(
            "nothing in the library makes forecasts better: {:.2} {unit} as calibrated, {:.2} {unit} with what fits best, noise \
             floor {:.2} {unit}; check that the recording is of what the model declares",
            scale * error.calibrated.rmse,
            scale * error.augmented.rmse,
            scale * error.noise_floor.rmse
        )));
    }
    None
}

/// Whether forecasts of the calibrated model err by little beside what the data do, where the equations are the user's own: by the
/// measure that decides, whose errors are `error`.
fn is_roughly_right(search: &Search<'_>, error: &ErrorTable) -> bool {
    let system = search.system();
    let Some(measure) = system.schema().measures.first().filter(|_| system.begins_from_first_samples())
    else {
        return false;
    };
    let records: Vec<Record> = search.test.records().map(|record| record.seen.clone()).collect();
    let squares: f64 = measure.channels.iter().map(|&channel| spread(&records, channel).powi(2)).sum();
    let count = if measure.length { 1 } else { measure.channels.len().max(1) };
    let moves = (squares / count as f64).sqrt();
    error.calibrated.rmse < ROUGHLY * moves
}

/// Whether most windows are followed from the best of starts, by the misfit of each in units of the noise and its degrees of
/// freedom.
fn follows(misfits: &[[f64; 2]]) -> bool {
    let mut ratios: Vec<f64> = misfits.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    !ratios.is_empty() && median(&mut ratios) <= FAR
}

/// Name and bound of the first declared parameter that stands at one which is not 0: at 0 a term is only absent.
fn at_bound(h: &Hypothesis, theta: &[f64]) -> Option<(String, f64)> {
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        let own = &theta[at..at + width];
        at += width;
        if f.addition.is_some() || f.per == Per::Trajectory {
            continue;
        }
        let near = AT_BOUND * (f.max - f.min);
        for bound in [f.min, f.max].into_iter().filter(|b| *b != 0.0) {
            if own.iter().any(|v| (v - bound).abs() <= near) {
                return Some((h.system.quantity(f.index).name, bound));
            }
        }
    }
    None
}

/// The calibrated model as the answer, without a search.
pub(crate) fn unsearched(search: &Search<'_>, base: Fit) -> Decided {
    let base = search.judge(base);
    let found = Explored { pool: vec![base.clone()], tried: vec![base.clone()], base_scores: Vec::new() };
    let tests = adequacy(search, &base, &found.tried, None);
    let (verdict, best) = (Verdict::NotThisSystem, base.clone());
    Decided {
        found,
        best,
        base,
        tests,
        verdict,
        severe: false,
        scattered: None,
        judged_by: JudgedBy::Windows,
    }
}

#[cfg(test)]
mod tests {
    //! Contract: data are followed where most windows miss by about their noise, and not where there are none.
    use super::*;

    #[test]
    fn most_windows_decide_whether_data_are_followed() {
        assert!(follows(&[[90.0, 100.0], [110.0, 100.0], [9e4, 100.0]]));
        assert!(!follows(&[[90.0, 100.0], [900.0, 100.0], [9e4, 100.0]]) && !follows(&[]));
    }
}
