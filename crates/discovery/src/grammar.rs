//! Formulas of a grammar in a system and among additions.

use crate::addition::Addition;
use augsim_physics::system::System;

/// Whether the library of a system has formulas of a grammar.
pub(crate) fn has_grammar(system: &dyn System) -> bool {
    system.library().iter().any(|effect| effect.grammar.is_some())
}

/// Whether an addition is a formula of a grammar.
pub(crate) fn is_formula(addition: &Addition) -> bool {
    addition.listed().is_some_and(|effect| effect.grammar.is_some())
}
