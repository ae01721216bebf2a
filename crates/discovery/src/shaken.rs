//! The answer where the motion itself is shaken.
//!
//! Over windows every misfit counts as one of the sensor. Where the motion is shaken, misfits grow and drift along a window, and a
//! ripple or a slow swing follows them better than none does, however little it is there. Under a filter that lets something push the
//! motion a law has to foretell readings that the pushes before them do not: terms leave the set by what the likelihood of readings gains
//! with them there (a ratio of likelihoods, each at its own parameters).

use crate::addition::labels;
use crate::decide::{Decided, JudgedBy, settle};
use crate::explore::{Explored, place_of};
use crate::judged::Judged;
use crate::likeliest::{Filtered, Likeliest};
use crate::options::Progress;
use crate::search::Search;
use crate::supported::without;
use rayon::prelude::*;

/// The answer under noise of the motion, where what `decided` leaves is such noise: its terms that readings speak for. The rest may be
/// noise or a law that nobody described: a fine ripple looks the same.
pub(crate) fn under_noise_of_the_motion(
    search: &Search<'_>,
    decided: Decided,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    let Some(readings) = Filtered::of(search.train.data) else { return decided };
    if decided.best.additions().is_empty() {
        return decided;
    }
    let Some(set) = Likeliest::of(&readings, &decided.best.fit) else { return decided };
    let Decided { found, base, best, .. } = &decided;
    let over_windows = OverWindows { search, found: found.clone(), base, best };
    let mut walk = Walk { search, readings: &readings, over_windows, set, has_untold: false };
    while walk.leave() {}
    let Walk { mut over_windows, set, has_untold, .. } = walk;
    let mut decided = if labels(set.additions()) == labels(best.additions()) {
        decided
    } else {
        let best = over_windows.of(&set);
        let found = over_windows.found;
        settle(search, found, decided.base, best, false, progress)
    };
    decided.judged_by = if has_untold { JudgedBy::Windows } else { JudgedBy::Filter };
    decided
}

/// Sets with their parameters over windows.
struct OverWindows<'s> {
    search: &'s Search<'s>,
    found: Explored,
    base: &'s Judged,
    best: &'s Judged,
}

impl OverWindows<'_> {
    fn of(&mut self, set: &Likeliest) -> Judged {
        match set.additions() {
            [] => self.base.clone(),
            additions => place_of(self.search, &mut self.found, self.best, additions),
        }
    }
}

/// A walk from set to set.
struct Walk<'s> {
    search: &'s Search<'s>,
    readings: &'s Filtered,
    over_windows: OverWindows<'s>,
    /// The present set.
    set: Likeliest,
    /// Whether it has terms that readings do not tell from chance.
    has_untold: bool,
}

impl Walk<'_> {
    /// Leaves the term that readings speak for least, of those that they do not tell from chance and without which free runs are not
    /// clearly worse: a law that is slow is one that pushes can take the place of. False where all terms stay.
    fn leave(&mut self) -> bool {
        let mut parts = self.parts();
        let likelier = parts.iter().filter(|part| part.ln_likelihood() > self.set.ln_likelihood());
        let likeliest = likelier.max_by(|a, b| a.ln_likelihood().total_cmp(&b.ln_likelihood()));
        // A set is at least as likely as a part of it: where it is not, its parameters are sought from those of the part.
        let again = likeliest.and_then(|part| part.beside(self.readings, self.search, self.set.additions()));
        if let Some(again) = again.filter(|again| again.ln_likelihood() > self.set.ln_likelihood()) {
            self.set = again;
            parts = self.parts();
        }
        let mut list: Vec<(Likeliest, f64)> = parts
            .into_iter()
            .map(|part| {
                let margin = margin(self.search, &self.set, &part);
                (part, margin)
            })
            .filter(|(_, margin)| *margin < 0.0)
            .collect();
        list.sort_by(|a, b| a.1.total_cmp(&b.1));
        let whole = self.over_windows.of(&self.set);
        self.has_untold = !list.is_empty();
        for (part, _) in list {
            if !self.search.part_runs_clearly_worse(&self.over_windows.of(&part), &whole) {
                self.set = part;
                return true;
            }
        }
        false
    }

    /// The set without each of its terms.
    fn parts(&self) -> Vec<Likeliest> {
        let numbers: Vec<usize> = (0..self.set.additions().len()).collect();
        let part = |number: &usize| {
            self.set.beside(self.readings, self.search, &without(self.set.additions(), *number))
        };
        numbers.par_iter().filter_map(part).collect()
    }
}

/// Gain in ln likelihood of a set over a part of it, less that which chance alone brings.
fn margin(search: &Search<'_>, set: &Likeliest, part: &Likeliest) -> f64 {
    let size = |set: &Likeliest| set.additions().iter().map(|a| search.size(a)).sum::<f64>();
    let needed = 0.5 * search.quantile(size(set) - size(part));
    set.ln_likelihood() - part.ln_likelihood() - needed
}
