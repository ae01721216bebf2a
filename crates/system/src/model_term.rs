//! Terms that can be added to a system: library effects and tables.

use crate::effect::Effect;

/// A term of a model: a library effect or a table.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelTerm {
    /// A library effect, by its index in the system's library.
    Effect(usize),
    /// A table: a piecewise-linear function of one feature.
    Table(Table),
}

impl ModelTerm {
    /// Number of parameters of the term.
    pub fn size(&self, library: &[Effect]) -> usize {
        match self {
            ModelTerm::Effect(i) => library.get(*i).map_or(0, |e| e.parameters.len()),
            ModelTerm::Table(table) => table.knots,
        }
    }
}

/// A piecewise-linear function of one feature (quantity), with uniform knots, constant outside them.
///
/// The values at the knots are the parameters of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table {
    /// Quantity that the table adds to, as an index into the schema's targets.
    pub target: usize,
    /// Quantity that the table depends on, as an index into the schema's features.
    pub feature: usize,
    /// Position of the first knot, in the feature's unit.
    pub first: f64,
    /// Position of the last knot, in the feature's unit.
    pub last: f64,
    /// Number of knots of the table.
    pub knots: usize,
}
