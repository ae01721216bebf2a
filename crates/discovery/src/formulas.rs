//! Search over formulas of a grammar, where the library leaves structured residuals.

use crate::addition::Addition;
use crate::columns::Family;
use crate::options::{Observer, Options, Progress};
use crate::prepare::Prepared;
use crate::search::Search;
use crate::stages::{SearchStage, search_with};

/// Whether formulas may explain more than the set of effects that would be named: its residuals exceed the noise, or it
/// depends on the past.
///
/// The best set may leave smaller residuals: it also has effects that are not significant. Hidden states have free initial
/// values in every window, with which they imitate laws of present values.
fn needs_formulas(prepared: &Prepared, searched: &mut SearchStage) -> bool {
    let named = searched.named_set(prepared);
    named.additions().iter().any(Addition::depends_on_past) || searched.exceeds_noise(prepared, &named)
}

/// Repeats the search with formulas as further candidates where they may explain more. Keeps the first
/// result unless the set of effects that is then named contains a formula.
pub(crate) fn search_formulas(
    prepared: &Prepared,
    mut searched: SearchStage,
    options: &Options,
    observer: &mut dyn Observer,
) -> SearchStage {
    let system = &*prepared.data.system;
    if !options.library
        || options.effects.is_closed()
        || !system.library().iter().any(|effect| effect.formula_domain.is_some())
        || prepared.clock.is_over()
        || !needs_formulas(prepared, &mut searched)
    {
        return searched;
    }
    observer.report(Progress::Formulas);
    let mut with_grammar = search_with(prepared, &searched, Family::Grammar);
    let named = {
        let SearchStage { view, families, found } = &mut with_grammar;
        let search = Search::new(view, families, &prepared.clock);
        if prepared.clock.is_over() {
            prepared.clock.end_search();
            crate::search::complete(&search, found);
        }
        crate::judge::named_set(&search, found)
    };
    let has_formula = with_grammar.found.sets[named].additions().iter().any(Addition::is_formula);
    if has_formula { with_grammar } else { searched }
}
