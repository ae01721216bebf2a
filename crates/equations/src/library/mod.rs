//! Effects that a model may lack, as rows of expressions that are applied at places of a model.

mod curve;
mod expand;
mod formulas;
mod named;
mod place;
mod robot;
mod row_place;
mod scale;
mod size;
mod substitute;
pub(crate) mod tables;

use crate::error::ModelError;
use crate::model::{Model, Row, read_all};
pub use curve::{Curve, curves};
pub use expand::{Candidate, CandidateParameter};
pub(crate) use formulas::formulas;
pub use named::{is_a_kind, similar_kinds};
pub use place::Kinematics;
pub(crate) use place::target_named;
pub use scale::Scales;
pub(crate) use size::size_unit;
pub use tables::draft as table_draft;

/// Text of the general library of effects.
const LIBRARY: &str = include_str!("../../library.toml");

/// Reads the rows of the general library of effects.
///
/// # Errors
/// None in practice: the text is part of this crate, and a test parses it.
pub fn generic() -> Result<Vec<Row>, ModelError> {
    read_all(LIBRARY, "library.toml")
}

/// Lists all effects that may be added to a model: the model file's own, then those of the general library.
///
/// Each effect is listed once for each of its places.
///
/// # Errors
/// A candidate with an unknown place, or whose expression cannot be parsed.
pub fn candidates(model: &Model) -> Result<Vec<Candidate>, ModelError> {
    let mut candidates: Vec<Candidate> = Vec::new();
    for row in &model.candidates {
        let mut offered = expand::expand(row, model)?;
        offered.iter_mut().for_each(|candidate| candidate.is_offered = true);
        candidates.append(&mut offered);
    }
    for row in generic()? {
        candidates.extend(expand::expand(&row, model)?);
    }
    expand::make_names_unique(&mut candidates);
    Ok(candidates)
}

/// Applies one row of the library at all its places in a model.
///
/// # Errors
/// See [`candidates`].
pub(crate) fn places_of(row: &Row, model: &Model) -> Result<Vec<Candidate>, ModelError> {
    expand::expand(row, model)
}
