//! Terms that can be added to a system: library effects and tables.

use crate::effect::Effect;

/// A term of a model: a library effect or a table.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelTerm {
    /// An effect, by its index in the system's library.
    Effect(usize),
    /// A piecewise-linear function of one feature.
    Table(Table),
}

impl ModelTerm {
    /// Number of parameters.
    pub fn size(&self, library: &[Effect]) -> usize {
        match self {
            ModelTerm::Effect(i) => library.get(*i).map_or(0, |e| e.parameters.len()),
            ModelTerm::Table(table) => table.knots,
        }
    }
}

/// A piecewise-linear function of one feature with uniform knots, constant outside them.
///
/// The values at the knots are its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table {
    /// Quantity that it adds to, as an index into the schema's targets.
    pub target: usize,
    /// Quantity that it depends on, as an index into the schema's features.
    pub feature: usize,
    /// First knot, in the feature's unit.
    pub first: f64,
    /// Last knot, in the feature's unit.
    pub last: f64,
    /// Number of knots.
    pub knots: usize,
}
