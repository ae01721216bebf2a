//! From a fitted declared model to an answer: search, confirmation, adequacy, laws outside the library.

use crate::Progress;
use crate::addition::Addition;
use crate::adequacy::{Adequacy, adequacy};
use crate::fit::Fit;
use crate::forecast;
use crate::free_runs::NO_WORSE;
use crate::grammar::{is_formula, nodes};
use crate::report::AMBIGUOUS_TOTAL;
use crate::result::Verdict;
use crate::search::{Found, Judged, Search};
use crate::unlisted::unlisted;

/// By how much a table must lower the criterion before the library's answer is given up.
pub(crate) const MARGIN: f64 = 10.0;

/// Ratio of forecast errors (of the training part) at which laws without scatter are taken for better than laws with it.
const LAWFUL: f64 = 0.8;

/// Gain in the criterion on the training part that is clear evidence by itself, and the loss on the held-out part, as a share
/// of it, that is tolerated then.
const CLEAR: f64 = 25.0;
const TOLERATED: f64 = 0.1;

/// The answer of one split.
pub(crate) struct Decided {
    pub found: Found,
    /// The calibrated model.
    pub base: Judged,
    pub best: Judged,
    /// Tests of what the best leaves.
    pub tests: Adequacy,
    pub verdict: Verdict,
    /// So much is left that the best is no explanation.
    pub severe: bool,
    /// The time was over before everything was tried.
    pub was_cut: bool,
}

/// Decides what the calibrated model `base` lacks; `None` if no hypothesis can be judged. Laws outside the library are looked
/// for if `tables`; `known` are sets that another search came to, which this one begins with.
pub(crate) fn decide(
    search: &mut Search<'_>,
    base: Fit,
    known: &[Judged],
    tables: bool,
    progress: &mut dyn FnMut(Progress),
) -> Option<Decided> {
    progress(Progress::Search);
    let mut found = search.run(base, known, progress);
    let base = found.pool.iter().find(|j| j.additions().is_empty());
    let base = base.or(found.tried.first()).cloned()?;
    let mut best = confirmed(&found, &base);
    let forecast_of = |search: &Search<'_>, j: &Judged| {
        forecast::rmse(&forecast::errors(&search.train, &j.fit, &j.fit.theta))
    };
    if best.fit.hypothesis.scatter.is_some()
        && !search.clock.is_over()
        && forecast_of(search, &best) > 0.95 * forecast_of(search, &base)
    {
        // Chance can be made to explain anything: where it forecasts no better, laws of the mean alone have to be tried.
        search.scatter = false;
        let other = search.run(base.fit.clone(), &[], progress);
        let lawful = confirmed(&other, &base);
        if forecast_of(search, &lawful) < LAWFUL * forecast_of(search, &best) {
            (found, best) = (other, lawful);
        }
    }

    progress(Progress::Adequacy);
    let mut tests = adequacy(search, &best);
    let (mut verdict, mut severe) = (Verdict::NothingToAdd, false);
    if !best.additions().is_empty() {
        verdict = Verdict::Explained;
    }
    if !tests.ok() || best.additions().len() > 3 {
        progress(Progress::Unlisted);
        severe = tests.severe();
        if tables
            && !search.clock.is_over()
            && let Some(wider) = widen(search, &base, &best)
        {
            let runs_worse = wider.free_run.zip(best.free_run).is_some_and(|(a, b)| a > NO_WORSE * b);
            let better = wider.criterion < best.criterion - MARGIN
                && wider.heldout_ll > best.heldout_ll
                && !runs_worse;
            if better {
                let listed = wider.additions().iter().any(|a| !matches!(a, Addition::Table(_)));
                verdict = if listed { Verdict::PartlyExplained } else { Verdict::Unknown };
                tests = adequacy(search, &wider);
                best = wider;
                severe = false;
            }
        }
        if severe {
            verdict = if best.additions().is_empty() { Verdict::Unknown } else { Verdict::PartlyExplained };
        }
    }
    let was_cut = search.clock.was_cut();
    Some(Decided { found, base, best, tests, verdict, severe, was_cut })
}

/// Whether the held-out part confirms what the training part found: by a `gain` there, in ln likelihood, or, where the training
/// part speaks clearly (`trained` in the criterion), by no more than chance against it (the estimate of an effect that is there
/// is above its truth in one half of all samples, and then the other half may see a small loss).
pub(crate) fn holds(trained: f64, gain: f64) -> bool {
    gain > 0.0 || (trained > CLEAR && gain > -TOLERATED * trained)
}

/// The best of a search, if the held-out part confirms it.
fn confirmed(found: &Found, base: &Judged) -> Judged {
    let confirms = |best: &&Judged| {
        let (Some(gain), trained) = (heldout_gain(best, base), base.criterion - best.criterion) else {
            return false;
        };
        holds(trained, gain)
    };
    let first = found.pool.first().filter(confirms).unwrap_or(base);
    simplest(found, first).clone()
}

/// The set with the shortest formulas among those that are as good as `best`.
fn simplest<'f>(found: &'f Found, best: &'f Judged) -> &'f Judged {
    if !best.additions().iter().any(is_formula) {
        return best;
    }
    let as_good = found.pool.iter().filter(|j| {
        let close = j.total() < best.total() + AMBIGUOUS_TOTAL;
        close && !j.additions().is_empty() && j.additions().len() <= best.additions().len()
    });
    as_good.min_by_key(|j| nodes(j)).unwrap_or(best)
}

/// Gain in ln likelihood on the held-out part.
pub(crate) fn heldout_gain(best: &Judged, base: &Judged) -> Option<f64> {
    best.heldout_ll.zip(base.heldout_ll).map(|(a, b)| a - b).filter(|g| g.is_finite())
}

/// Looks for tables from the base and from the best library model.
fn widen(search: &Search<'_>, base: &Judged, best: &Judged) -> Option<Judged> {
    let mut starts = vec![base.clone()];
    if !best.additions().is_empty() {
        starts.push(best.clone());
    }
    let mut wider = unlisted(search, base, &starts)?;
    wider.heldout_ll = Some(search.heldout(&wider.fit).ll);
    Some(wider)
}
