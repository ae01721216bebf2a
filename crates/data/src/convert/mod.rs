//! Measured sets by others, in their own layouts, turned into the long form; one file for each set.
//!
//! Each converter gives the data and, where one fits, the model file that declares what anyone would: gravity, a
//! constant restitution; the uniform limit surface of the object and textbook friction.

mod cmu_mlab;
mod desilva;
mod mit_push;
mod mit_pusher_slider;
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
    /// A model file to begin with; `None` where no single one fits all trajectories.
    pub model_toml: Option<String>,
}

/// A converter: from the folder of a set (for pushes also a single file of it).
pub type Converter = fn(&Path) -> Result<Converted, DataError>;

/// The sets that can be converted, by name; those of balls are called as their folder.
pub const CONVERTERS: [(&str, Converter); 6] = [
    ("cmu-mlab", cmu_mlab::convert),
    ("desilva-ball-drops", desilva::convert),
    ("mit-push", mit_push::convert),
    ("mit-pusher-slider", mit_pusher_slider::convert),
    ("paper-stack-bounces", paper_stack::convert),
    ("spindoe-table-tennis", spindoe::convert),
];

/// Whether a set of [`CONVERTERS`] is of pushes: those are large, so one who wants balls asks before converting.
pub fn is_of_pushes(set: &str) -> bool {
    matches!(set, "cmu-mlab" | "mit-push" | "mit-pusher-slider")
}

/// A number that must be there.
fn required(source: &CsvSource, cell: usize) -> Result<f64, DataError> {
    source.number(cell)?.ok_or_else(|| source.empty_cell(cell, "this layout has no gaps"))
}
