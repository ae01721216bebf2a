//! From a fitted declared model to an answer: search, confirmation, adequacy, laws outside the library.

use crate::Progress;
use crate::addition::{Addition, labels};
use crate::adequacy::{Adequacy, adequacy};
use crate::confirmation::holds;
use crate::explore::{Explored, place_of};
use crate::fit::{ChosenRecords, Fit};
use crate::forecast;
use crate::free_runs::NO_WORSE;
use crate::grammar::{has_grammar, is_formula, nodes};
use crate::judged::{Judged, is_as_good};
use crate::result::Verdict;
use crate::scattered::{Scattered, scattered, surviving_additions};
use crate::search::Search;
use crate::supported::supported;
use crate::unlisted::unlisted;
use augsim_physics::system::ScatterPer;

/// By how much a table must lower the criterion before the library's answer is given up.
const MARGIN: f64 = 10.0;

/// Ratio of forecast errors (of both parts together) at which laws without scatter are taken for better than laws with it.
const LAWFUL: f64 = 0.8;

/// Share of the variance of a scatter from which on it is one of the records.
const MOST_OF_IT: f64 = 0.5;

/// The answer of one split.
pub(crate) struct Decided {
    pub found: Explored,
    /// The calibrated model.
    pub base: Judged,
    pub best: Judged,
    /// Tests of what the best leaves.
    pub tests: Adequacy,
    pub verdict: Verdict,
    /// So much is left that the best is no explanation.
    pub severe: bool,
    /// Parameters that are drawn anew for each record.
    pub scattered: Option<Scattered>,
    pub judged_by: JudgedBy,
}

/// The judge of an answer's terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JudgedBy {
    /// Misfits over windows.
    Windows,
    /// A filter under which the motion may be shaken, and readings speak for each of them.
    Filter,
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
    let calibrated = base.theta.clone();
    let mut found = search.run(base, known, progress);
    let base = found.pool.iter().find(|j| j.additions().is_empty());
    let base = base.or(found.tried.first()).cloned()?;
    let mut best = confirmed(search, &found, &base);
    let forecast_of = |search: &Search<'_>, j: &Judged| forecast::first_rmse(&search.train, &j.fit);
    if best.fit.hypothesis.scatter.is_some()
        && !search.clock.is_over()
        && forecast_of(search, &best) > 0.95 * forecast_of(search, &base)
    {
        // Chance can be made to explain anything: where it forecasts no better, laws of the mean alone have to be tried.
        search.ways = &[];
        let other = search.run(base.fit.clone(), &[], progress);
        let lawful = confirmed(search, &other, &base);
        // Laws that follow the draws of the training part forecast no others: the held-out part has its say, but a few of its records
        // with large errors do not decide alone.
        let forecasts = |sample: &ChosenRecords<'_>| {
            [&lawful, &best]
                .map(|j| forecast::first_rmse(sample, &j.fit).powi(2) * sample.chosen.len() as f64)
        };
        let [trained, held] = [&search.train, &search.test].map(forecasts);
        if trained[0] + held[0] < LAWFUL.powi(2) * (trained[1] + held[1]) && held[0] < held[1] {
            (found, best) = (other, lawful);
        }
    }

    if !search.clock.is_over() && is_shared_by_records(&best) {
        search.ways = &[ScatterPer::Record];
        let other = search.run(base.fit.clone(), &[], progress);
        let shared = confirmed(search, &other, &base);
        if shared.fit.hypothesis.scatter.is_some() {
            (found, best) = (other, shared);
        }
    }

    best = supported(search, &mut found, &base, best);
    if let Some(surviving) = surviving_additions(search, &best) {
        best = without_chance(search, &mut found, &base, &best, &surviving);
    }
    let base =
        if best.additions().is_empty() { base } else { as_calibrated(search, &found, &calibrated, base) };
    Some(settle(search, found, base, best, tables, progress))
}

/// Whether what was added as a scatter from event to event is for the most part one from record to record. The likelihood takes
/// the former also where the events of a record differ by a little that no law explains (an engine's steps).
fn is_shared_by_records(best: &Judged) -> bool {
    let per_event = |a: &Addition| matches!(a, Addition::Scatter(s) if s.per == ScatterPer::Event);
    let shared = best.fit.spread.shared.filter(|_| best.additions().iter().any(per_event));
    shared.is_some_and(|[share, error]| share - 2.0 * error > MOST_OF_IT)
}

/// The declared model as it was calibrated, which additions are shown against. Fitted from the best set's place its cost may be less,
/// but nobody could have calibrated it from there.
fn as_calibrated(search: &Search<'_>, found: &Explored, theta: &[f64], base: Judged) -> Judged {
    let mut tried = found.tried.iter().filter(|j| j.additions().is_empty());
    match tried.find(|j| j.fit.theta == theta) {
        Some(judged) => Judged { heldout_ll: Some(search.heldout(judged).ll), ..judged.clone() },
        None => base,
    }
}

/// The answer of a search whose best hypothesis is `best`: what that leaves, laws outside the library, verdict.
pub(crate) fn settle(
    search: &Search<'_>,
    found: Explored,
    base: Judged,
    mut best: Judged,
    tables: bool,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    progress(Progress::Adequacy);
    let scattered = scattered(search, &best);
    let mut tests = adequacy(search, &best, &found.tried, scattered.as_ref());
    let (mut verdict, mut severe) = (Verdict::NothingToAdd, false);
    let named =
        |best: &Judged| !best.additions().is_empty() || scattered.as_ref().is_some_and(|s| !s.declared);
    if named(&best) {
        verdict = Verdict::Explained;
    }
    if !tests.ok() || best.additions().len() > 3 {
        progress(Progress::Unlisted);
        severe = tests.severe();
        if tables
            && !search.clock.is_over()
            && let Some(wider) = widen(search, &base, &best)
        {
            verdict = verdict_on_tables(&wider);
            tests = adequacy(search, &wider, &found.tried, None);
            best = wider;
            severe = false;
        }
        if severe {
            verdict = if named(&best) { Verdict::PartlyExplained } else { Verdict::Unknown };
        }
    }
    Decided { found, base, best, tests, verdict, severe, scattered, judged_by: JudgedBy::Windows }
}

/// The hypothesis with the additions that survive where records scatter, if it is confirmed. What only chance speaks for is
/// no rival either.
fn without_chance(
    search: &Search<'_>,
    found: &mut Explored,
    base: &Judged,
    best: &Judged,
    surviving: &[Addition],
) -> Judged {
    let chance: Vec<&Addition> = best.additions().iter().filter(|a| !surviving.contains(a)).collect();
    let lawful = |j: &Judged| !j.additions().iter().any(|a| chance.contains(&a));
    found.pool.retain(lawful);
    found.tried.retain(lawful);
    let less = place_of(search, found, best, surviving);
    if is_confirmed(&less, base) { less } else { base.clone() }
}

/// The answer with some of its additions alone. Tables are looked for beside them where no formulas came before.
pub(crate) fn with_only(
    search: &Search<'_>,
    decided: Decided,
    additions: &[Addition],
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    let Decided { mut found, base, best, .. } = decided;
    let best = place_of(search, &mut found, &best, additions);
    settle(search, found, base, best, !has_grammar(search.system()), progress)
}

/// Whether so large a fall of the criterion is worth giving up the library's answer for a table or a formula.
pub(crate) fn is_worth_a_table(fall: f64) -> bool {
    fall > MARGIN
}

/// The set with the shortest formulas among those that are as good as `best`.
fn simplest<'f>(found: &'f Explored, best: &'f Judged) -> &'f Judged {
    if !best.additions().iter().any(is_formula) {
        return best;
    }
    let as_good = found.pool.iter().filter(|j| {
        let close = is_as_good(j.total() - best.total(), 1.0);
        close && !j.additions().is_empty() && j.additions().len() <= best.additions().len()
    });
    as_good.min_by_key(|j| nodes(j)).unwrap_or(best)
}

/// Whether a hypothesis pays its penalty on the training part, is away from its nulls, and holds on the other part.
fn is_confirmed(judged: &Judged, base: &Judged) -> bool {
    judged.additions().is_empty()
        || (judged.criterion < base.criterion && holds_over(judged, base) && judged.fit.is_clear())
}

/// Whether the held-out part confirms what a hypothesis gains over another on the training part, in units of its dispersion.
fn holds_over(judged: &Judged, other: &Judged) -> bool {
    let trained = (other.criterion - judged.criterion) / judged.unit;
    heldout_gain(judged, other).is_some_and(|gain| holds(trained, gain))
}

/// Whether the data let a hypothesis be an answer, the best one or one that is as good.
pub(crate) fn may_answer(search: &Search<'_>, judged: &Judged, base: &Judged) -> bool {
    if search.train.data.is_idealised() {
        return is_confirmed(judged, base);
    }
    holds_over(judged, base)
}

/// The best on both parts together, if it is confirmed. Where the laws of the system are idealisations: the best of all that
/// are, in its simplest form that is as good. (For exact laws Wald's test is no further evidence and costs drag beside a law
/// that stands for it: the best total decides.)
fn confirmed(search: &Search<'_>, found: &Explored, base: &Judged) -> Judged {
    if !search.train.data.is_idealised() {
        let first = found.pool.first().filter(|j| may_answer(search, j, base));
        return simplest(found, first.unwrap_or(base)).clone();
    }
    let best = found.pool.iter().find(|j| is_confirmed(j, base)).unwrap_or(base);
    let (simple, fewer) = search.simplified(best.additions());
    let key = labels(&simple);
    let less = found.pool.iter().find(|j| !fewer.is_empty() && labels(j.additions()) == key);
    let as_good =
        |j: &&Judged| is_confirmed(j, base) && j.total() < best.total() + search.beyond(&fewer, best.unit);
    less.filter(as_good).unwrap_or(best).clone()
}

/// Gain in ln likelihood on the held-out part, in units of the dispersion.
pub(crate) fn heldout_gain(best: &Judged, base: &Judged) -> Option<f64> {
    best.heldout_ll.zip(base.heldout_ll).map(|(a, b)| (a - b) / best.unit).filter(|g| g.is_finite())
}

/// The verdict on an explanation with tables: a table is no law.
pub(crate) fn verdict_on_tables(wider: &Judged) -> Verdict {
    let listed = wider.additions().iter().any(|a| !matches!(a, Addition::Table(_)));
    if listed { Verdict::PartlyExplained } else { Verdict::Unknown }
}

/// The best explanation with tables, looked for from the base and from the best model without; `None` where it is not so much
/// better that the best is given up for it.
pub(crate) fn widen(search: &Search<'_>, base: &Judged, best: &Judged) -> Option<Judged> {
    let mut starts = vec![base.clone()];
    if !best.additions().is_empty() {
        starts.push(best.clone());
    }
    let mut wider = unlisted(search, base, &starts)?;
    wider.heldout_ll = Some(search.heldout(&wider).ll);
    let runs_worse = wider.free_run.zip(best.free_run).is_some_and(|(a, b)| a > NO_WORSE * b);
    let is_better =
        is_worth_a_table(best.criterion - wider.criterion) && holds_over(&wider, best) && !runs_worse;
    is_better.then_some(wider)
}

#[cfg(test)]
mod tests {
    //! Contract: the library's answer gives way to a table for odds of more than a hundred to one, and not for less.
    use super::*;

    #[test]
    fn a_table_needs_odds_of_more_than_a_hundred_to_one() {
        let fall = |odds: f64| 2.0 * odds.ln();
        assert!(!is_worth_a_table(fall(60.0)) && is_worth_a_table(fall(400.0)));
    }
}
