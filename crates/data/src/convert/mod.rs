//! Converters of published data sets to the long form, one file per set.
//!
//! Each converter returns the data and, where one model fits all trajectories, a model file to begin with.
//! For balls it declares gravity and a constant restitution, for pushes the limit surface of uniform pressure
//! and published friction.

mod cmu_mlab;
mod desilva;
mod mit_push;
mod mit_pusher_slider;
mod paper_stack;
mod spindoe;

use crate::dataset::Dataset;
use crate::error::DataError;
use std::path::Path;

/// Published data set after its conversion, with a model file to begin with.
#[derive(Clone, Debug, PartialEq)]
pub struct Converted {
    /// Trajectories of the published set, in the long form.
    pub data: Dataset,
    /// TOML text of a model file to begin with; `None` where no single model fits all trajectories.
    pub model_toml: Option<String>,
}

/// Function that converts the folder of a data set; for pushes also a single file of it.
pub type Converter = fn(&Path) -> Result<Converted, DataError>;

/// Converters by the name of the data set; sets of balls have the name of their folder.
pub const CONVERTERS: [(&str, Converter); 6] = [
    ("cmu-mlab", cmu_mlab::convert),
    ("desilva-ball-drops", desilva::convert),
    ("mit-push", mit_push::convert),
    ("mit-pusher-slider", mit_pusher_slider::convert),
    ("paper-stack-bounces", paper_stack::convert),
    ("spindoe-table-tennis", spindoe::convert),
];

/// Whether a data set of [`CONVERTERS`] holds pushes; these are large, so commands for balls skip them.
pub fn holds_pushes(set: &str) -> bool {
    matches!(set, "cmu-mlab" | "mit-push" | "mit-pusher-slider")
}
