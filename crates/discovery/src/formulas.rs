//! Search over formulas of a grammar, where the library leaves structured residuals.

use crate::addition::Addition;
use crate::columns::Family;
use crate::options::{Observer, Options, Progress};
use crate::prepare::{Prepared, residual_sds};
use crate::score::Scored;
use crate::stages::{SearchStage, search_in};

/// Ratio of residual standard deviation to noise above which formulas are searched; below it no prediction
/// would improve.
const BEYOND_NOISE: f64 = 1.1;

/// Repeats the search with formulas as further candidates if the residuals exceed the noise. Keeps the first
/// result unless the set of effects that is then named contains a formula.
pub(crate) fn search_formulas(
    prepared: &Prepared,
    searched: SearchStage,
    options: &Options,
    observer: &mut dyn Observer,
) -> SearchStage {
    let exceeds_noise = || {
        let residual_sd = residual_sds(&searched.view.sample(), &searched.found.best().fit);
        residual_sd.iter().zip(&prepared.noise.sd).any(|(residual_sd, sd)| *residual_sd > BEYOND_NOISE * sd)
    };
    let system = &*prepared.data.system;
    if !options.library
        || options.effects.is_closed()
        || !system.library().iter().any(|effect| effect.formula_domain.is_some())
        || prepared.clock.is_over()
        || !exceeds_noise()
    {
        return searched;
    }
    observer.report(Progress::Formulas);
    let families = [Family::Library, Family::Grammar];
    let mut known_sets: Vec<Scored> = searched.found.sets.clone();
    let base = known_sets.remove(0);
    let mut with_grammar =
        search_in(prepared, searched.view.clone(), &families, base, known_sets, &mut |_| {});
    let named = {
        let SearchStage { view, families, found } = &mut with_grammar;
        let search = crate::search::Search::new(view, families, &prepared.clock);
        if prepared.clock.is_over() {
            prepared.clock.end_search();
            crate::search::complete(&search, found);
        }
        crate::judge::named_set(&search, found)
    };
    let has_formula = with_grammar.found.sets[named].additions().iter().any(Addition::is_formula);
    if has_formula { with_grammar } else { searched }
}
