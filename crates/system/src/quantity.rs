//! Name and unit of a quantity.

/// Name and unit of a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Name of the quantity in results, without the unit.
    pub name: String,
    /// Unit of the quantity as printed; empty for a dimensionless number.
    pub unit: String,
}

impl Quantity {
    /// Creates a quantity from its name and unit.
    pub fn new(name: &str, unit: &str) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}
