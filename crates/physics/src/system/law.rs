//! Laws that a system may be augmented by.

use super::Effect;

/// A law in a model.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// An effect, by its place in the system's library.
    Effect(usize),
    /// A law that the library does not have.
    Table(Table),
}

impl Law {
    /// Number of its parameters.
    pub fn size(&self, library: &[Effect]) -> usize {
        match self {
            Law::Effect(i) => library.get(*i).map_or(0, |e| e.parameters.len()),
            Law::Table(table) => table.knots,
        }
    }
}

/// A piecewise-linear function of one feature: values at uniform knots, constant outside. The values are its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table {
    /// The quantity that it adds to, by its place in the schema's targets.
    pub target: usize,
    /// The quantity that it depends on, by its place in the schema's features.
    pub against: usize,
    /// First knot, in the feature's unit.
    pub first: f64,
    /// Last knot, in the feature's unit.
    pub last: f64,
    /// Number of knots.
    pub knots: usize,
}
