//! The answer where the motion itself is shaken.
//!
//! Over windows every misfit counts as one of the sensor. Where the motion is shaken, misfits grow and drift along a window, and a
//! ripple or a slow swing follows them better than none does, however little it is there. Under a filter that lets something push the
//! motion a law has to foretell readings that the pushes before them do not: terms leave the set, and others join it, by what the
//! likelihood of readings gains with them there (a ratio of likelihoods, each at its own parameters).

use crate::addition::{Addition, labels};
use crate::candidates::{Family, may_join};
use crate::decide::{Decided, settle};
use crate::explore::place_of;
use crate::forecast::first_rmse;
use crate::free_runs::NO_WORSE;
use crate::grammar::has_grammar;
use crate::judged::Judged;
use crate::likeliest::{Filtered, Likeliest};
use crate::options::Progress;
use crate::prepare::Prepared;
use crate::result::Verdict;
use crate::search::{MOST_EFFECTS, Search};
use crate::supported::without;
use rayon::prelude::*;

/// Candidates that are fitted of those that promise most.
const MOST_FITTED: usize = 3;

/// The answer under noise of the motion, where what `decided` leaves is such noise: its terms that readings speak for, and those of the
/// library that they speak for beside them. Where they speak for nothing else, not for a formula either, what is left is noise.
pub(crate) fn under_noise_of_the_motion(
    prepared: &Prepared,
    search: &Search<'_>,
    decided: Decided,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    let Some(readings) = Filtered::of(search.train.data) else { return decided };
    if !readings.are_of_a_shaken_motion(&decided.best) {
        return decided;
    }
    let Some(mut present) = Likeliest::of(&readings, &decided.best.fit) else { return decided };
    let began = labels(decided.best.additions());
    loop {
        while let Some(less) = less(search, &readings, &present) {
            present = less;
        }
        match more(search, &readings, &present) {
            Some(wider) if runs_no_worse(search, &decided, &present, &wider) => present = wider,
            _ => break,
        }
    }
    let is_all = !has_grammar(search.system()) || {
        let formulas = Search::on(prepared, Family::Grammar);
        promising(&formulas, &readings, &present).is_empty()
    };
    let mut decided = decided;
    if labels(present.additions()) != began {
        let Decided { mut found, base, best, .. } = decided;
        let best = fitted(search, &mut found, &base, &best, &present);
        decided = settle(search, found, base, best, false, progress);
    }
    let has_table = decided.best.additions().iter().any(|a| matches!(a, Addition::Table(_)));
    if is_all && decided.severe && !has_table {
        decided.severe = false;
        decided.verdict =
            if decided.best.additions().is_empty() { Verdict::NothingToAdd } else { Verdict::Explained };
    }
    decided
}

/// A set with its parameters over windows.
fn fitted(
    search: &Search<'_>,
    found: &mut crate::explore::Explored,
    base: &Judged,
    best: &Judged,
    set: &Likeliest,
) -> Judged {
    match set.additions() {
        [] => base.clone(),
        additions => place_of(search, found, best, additions),
    }
}

/// The set without that of its terms which readings speak for least, where they do not tell it from chance.
fn less(search: &Search<'_>, readings: &Filtered, set: &Likeliest) -> Option<Likeliest> {
    let numbers: Vec<usize> = (0..set.additions().len()).collect();
    let rest = |number: &usize| {
        let rest = Likeliest::beside(readings, search, &without(set.additions(), *number), set, None)?;
        let margin = set.ln_likelihood() - rest.ln_likelihood() - needed(search, set, &rest);
        (margin < 0.0).then_some((rest, margin))
    };
    let found: Vec<Option<(Likeliest, f64)>> = numbers.par_iter().map(rest).collect();
    found.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(rest, _)| rest)
}

/// The set with the term beside it that readings speak for most, where they tell one from chance.
fn more(search: &Search<'_>, readings: &Filtered, set: &Likeliest) -> Option<Likeliest> {
    if set.additions().len() >= MOST_EFFECTS {
        return None;
    }
    let promising = promising(search, readings, set);
    let wider = |(addition, theta): &(Addition, Vec<f64>)| {
        let mut additions = set.additions().to_vec();
        additions.push(addition.clone());
        let wider = Likeliest::beside(readings, search, &additions, set, Some(theta))?;
        let margin = wider.ln_likelihood() - set.ln_likelihood() - needed(search, &wider, set);
        (margin > 0.0).then_some((wider, margin))
    };
    let best = &promising[..promising.len().min(MOST_FITTED)];
    let found: Vec<Option<(Likeliest, f64)>> = best.par_iter().map(wider).collect();
    found.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(wider, _)| wider)
}

/// Terms of a search's library that promise more beside a set than chance does, the best first, with the parameters at which they do.
fn promising(search: &Search<'_>, readings: &Filtered, set: &Likeliest) -> Vec<(Addition, Vec<f64>)> {
    let candidates: Vec<&Addition> = search
        .library
        .iter()
        .filter(|a| matches!(a, Addition::Effect(..)) && may_join(a, set.hypothesis()))
        .collect();
    let promise = |addition: &&Addition| {
        let (gain, theta) = set.promise(readings, search, addition)?;
        let margin = gain - 0.5 * search.quantile(search.size(addition));
        (margin > 0.0).then(|| ((*addition).clone(), theta, margin))
    };
    let found: Vec<Option<(Addition, Vec<f64>, f64)>> = candidates.par_iter().map(promise).collect();
    let mut found: Vec<(Addition, Vec<f64>, f64)> = found.into_iter().flatten().collect();
    found.sort_by(|a, b| b.2.total_cmp(&a.2));
    found.into_iter().map(|(addition, theta, _)| (addition, theta)).collect()
}

/// Gain in ln likelihood that chance alone exceeds, of a set over a part of it.
fn needed(search: &Search<'_>, set: &Likeliest, part: &Likeliest) -> f64 {
    let size = |set: &Likeliest| set.additions().iter().map(|a| search.size(a)).sum::<f64>();
    0.5 * search.quantile(size(set) - size(part))
}

/// Whether a wider set forecasts held-out windows no worse than a part of it does.
fn runs_no_worse(search: &Search<'_>, decided: &Decided, part: &Likeliest, wider: &Likeliest) -> bool {
    let rmse = |set: &Likeliest| {
        first_rmse(&search.test, &search.refit(&decided.best.fit, set.additions(), &[]).fit)
    };
    let [part, wider] = [part, wider].map(rmse);
    wider <= NO_WORSE * part
}
