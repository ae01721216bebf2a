//! Formulas where the library ends.

use crate::DiscoveryError;
use crate::addition::Addition;
use crate::candidates::Family;
use crate::decide::{Decided, decide, is_worth_a_table};
use crate::free_runs::NO_WORSE;
use crate::grammar::{has_grammar, is_formula};
use crate::judged::Judged;
use crate::prepare::{Prepared, misfit};
use crate::result::Verdict;
use crate::search::Search;
use crate::{Options, Progress};

/// Share of the squared misfit that a formula has to take away to be worth its name.
const WORTH: f64 = 0.05;

/// Misfit in standard deviations of the noise above which formulas are searched.
const BEYOND_NOISE: f64 = 1.1;

/// Whether tests see what the library leaves, and it is more than the noise: a tenth of it, in one channel at least. Tests of
/// thousands of samples see less than that, and a formula for it takes minutes and improves no forecast.
pub(crate) fn leaves_something(prepared: &Prepared, decided: &Decided) -> bool {
    if decided.tests.ok() {
        return false;
    }
    let left = misfit(&prepared.sample(&prepared.train), &decided.best.fit);
    left.iter().zip(&prepared.noise.sd).any(|(left, sd)| *left > BEYOND_NOISE * sd)
}

/// The answer of the search over formulas that begins at what the library came to; `None` where no formula takes a part of what
/// is left away, in training windows, in held-out ones and in free runs.
pub(crate) fn beyond_the_library(
    prepared: &Prepared,
    decided: &Decided,
    progress: &mut dyn FnMut(Progress),
) -> Option<Decided> {
    progress(Progress::Formulas);
    let mut search = Search::on(prepared, Family::Grammar);
    // A law that the library named beside others is a formula's rival: what it can describe keeps its name.
    let sets = decided.found.pool.iter().flat_map(Judged::additions);
    for law in sets.filter(|a| matches!(a, Addition::Effect(..))) {
        if !search.library.contains(law) {
            search.library.push(law.clone());
            search.tests += 1;
        }
    }
    let (base, before) = (&decided.base, &decided.best);
    let known: Vec<Judged> = (!before.additions().is_empty()).then(|| before.clone()).into_iter().collect();
    let mut found = decide(&mut search, base.fit.clone(), &known, false, progress)?;
    let after = &found.best;
    let [left, was] = [after, before].map(|j| misfit(&search.train, &j.fit));
    let squares = left.iter().zip(&was).map(|(a, b)| (a / b).powi(2)).sum::<f64>() / was.len().max(1) as f64;
    let runs_worse = after.free_run.zip(before.free_run).is_some_and(|(a, b)| a > NO_WORSE * b);
    let is_better = after.additions().iter().any(is_formula)
        && squares < 1.0 - WORTH
        && is_worth_a_table(before.criterion - after.criterion)
        && after.heldout_ll > before.heldout_ll
        && !runs_worse
        && !search.runs_worse(after, before);
    if !is_better {
        return None;
    }
    if !found.tests.ok() {
        found.verdict = Verdict::PartlyExplained;
    }
    // What the library came to is shown beside the formulas.
    found.found.tried.extend(decided.found.tried.iter().cloned());
    Some(found)
}

/// The answer of a search over the library and, where it leaves something, over formulas.
///
/// # Errors
/// No hypothesis can be judged.
pub(crate) fn answer(
    prepared: &Prepared,
    options: &Options,
    from: Option<&Decided>,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Decided, Family), DiscoveryError> {
    let family = if options.library { Family::Described } else { Family::Grammar };
    let mut search = Search::on(prepared, family);
    let (base, known) = match from {
        None => {
            progress(Progress::Calibration);
            (crate::calibrate::calibrate(&search.train), Vec::new())
        }
        Some(from) => {
            let known = from.found.pool.iter().filter(|j| !j.additions().is_empty()).cloned().collect();
            (search.refit(&from.base.fit, &[], &[]).fit, known)
        }
    };
    let too_few = || DiscoveryError::TooFew { data: prepared.data.name.clone(), found: 0 };
    // With a grammar formulas come before tables.
    let decided = decide(&mut search, base, &known, !has_grammar(&*prepared.data.system), progress)
        .ok_or_else(too_few)?;
    Ok((decided, family))
}
