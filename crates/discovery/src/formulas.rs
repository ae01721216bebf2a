//! Formulas where the library ends.

use crate::columns::Family;
use crate::grammar::{has_grammar, is_formula};
use crate::options::{Options, Progress};
use crate::prepare::{Prepared, misfit};
use crate::score::Scored;
use crate::stages::{Searched, searched_on};

/// Misfit in standard deviations of the noise above which formulas are looked for: what is less improves no prediction.
const BEYOND_NOISE: f64 = 1.1;

/// The search once more with formulas as further candidates, where the library leaves more than noise; what it came to stays where no
/// formula is significant and better.
pub(crate) fn with_formulas(
    prepared: &Prepared,
    searched: Searched,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Searched {
    let leaves = || {
        let left = misfit(&searched.view.sample(), &searched.found.best().fit);
        left.iter().zip(&prepared.noise.sd).any(|(left, sd)| *left > BEYOND_NOISE * sd)
    };
    let system = &*prepared.data.system;
    if !options.library || !has_grammar(system) || prepared.clock.is_over() || !leaves() {
        return searched;
    }
    progress(Progress::Formulas);
    let families = [Family::Described, Family::Grammar];
    let mut known: Vec<Scored> = searched.found.tried.clone();
    let base = known.remove(0);
    let mut wider = searched_on(prepared, searched.view.clone(), &families, base, known, &mut |_| {});
    let named = {
        let Searched { view, families, found } = &mut wider;
        let search = crate::search::Search::new(view, families, &prepared.clock);
        crate::judge::named(&search, found)
    };
    let has_formula = wider.found.tried[named].additions().iter().any(is_formula);
    if has_formula { wider } else { searched }
}
