//! Measured sets by others, in their own layouts, turned into the long form; one file for each set.
//!
//! Each converter gives the data and the model file that declares what anyone would: gravity, a constant restitution.

mod desilva;
mod paper_stack;
mod spindoe;

use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use std::path::Path;

/// A converted set.
#[derive(Clone, Debug, PartialEq)]
pub struct Converted {
    /// The trajectories.
    pub data: Dataset,
    /// A model file to begin with.
    pub model_toml: &'static str,
}

/// A converter: from the folder of a set.
pub type Converter = fn(&Path) -> Result<Converted, DataError>;

/// The sets that can be converted, by the name of their folder.
pub const CONVERTERS: [(&str, Converter); 3] = [
    ("desilva-ball-drops", desilva::convert),
    ("paper-stack-bounces", paper_stack::convert),
    ("spindoe-table-tennis", spindoe::convert),
];

/// A number that must be there.
fn required(source: &CsvSource, cell: usize) -> Result<f64, DataError> {
    source.number(cell)?.ok_or_else(|| source.empty_cell(cell, "this layout has no gaps"))
}
