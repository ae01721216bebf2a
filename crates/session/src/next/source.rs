//! An explanation of the data so far, as it is read.

use augsim_equations::Model;
use std::collections::BTreeMap;

/// A live explanation before it is compiled.
#[derive(Debug, Clone)]
pub struct Source {
    /// Name of the explanation.
    pub name: String,
    /// Fitted model.
    pub model: Model,
    /// Logarithm of its weight by all earlier data, up to a constant.
    pub log_weight: f64,
    /// Widths of smoothed jumps that an earlier plan has chosen, by the text of their argument; empty without one.
    pub widths: BTreeMap<String, f64>,
}

impl Source {
    /// An explanation of which no earlier plan knows anything.
    pub fn new(name: impl Into<String>, model: Model) -> Self {
        Self { name: name.into(), model, log_weight: 0.0, widths: BTreeMap::new() }
    }
}
