//! A named number with its unit.

/// A named number with its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Name as in results, without the unit.
    pub name: String,
    /// Unit in print; empty for a pure number.
    pub unit: String,
}

impl Quantity {
    /// A quantity by name and unit.
    pub fn new(name: &str, unit: &str) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}
