//! Effects that a system of equations may lack, as data: rows of expressions, expanded for the places of a model.

mod curve;
mod expand;
mod formulas;
mod named;
mod place;
mod scale;
mod size;
mod substitute;
pub(crate) mod tables;

use crate::error::ModelError;
use crate::model::{Model, Row, read_all};
pub use curve::{Curve, curves};
pub use expand::{Candidate, CandidateParameter};
pub(crate) use formulas::formulas;
pub use named::{is_a_kind, kinds_like};
pub use place::Motion;
pub(crate) use place::target_named;
pub use scale::Scales;
pub(crate) use size::size_unit;
pub use tables::draft as table_draft;

/// The text of the generic library.
const GENERIC: &str = include_str!("../../library.toml");

/// The rows of the generic library.
///
/// # Errors
/// None: the text is part of this crate, and a test reads it.
pub fn generic() -> Result<Vec<Row>, ModelError> {
    read_all(GENERIC, "library.toml")
}

/// Everything that may be tried on a model: its own candidates, then the rows of the generic library, at all their places.
///
/// # Errors
/// A candidate that cannot be placed, or whose expression cannot be read.
pub fn candidates(model: &Model) -> Result<Vec<Candidate>, ModelError> {
    let own = model.candidates.iter().cloned();
    let mut all: Vec<Candidate> = Vec::new();
    for row in own.chain(generic()?) {
        all.extend(expand::expand(&row, model)?);
    }
    expand::name_apart(&mut all);
    Ok(all)
}

/// Places of one row in a model.
///
/// # Errors
/// See [`candidates`].
pub(crate) fn places_of(row: &Row, model: &Model) -> Result<Vec<Candidate>, ModelError> {
    expand::expand(row, model)
}
