//! Errors of a discovery run.

use augsim_system::{Objection, RoundTripError, UnknownGroup};
use std::fmt;
use thiserror::Error;

/// Names of the groups of a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Groups(pub Vec<String>);

/// Displays as `groups of the data: a, b`.
impl fmt::Display for Groups {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0[..] {
            [] => f.write_str("the data have no column `group`"),
            names => write!(f, "groups of the data: {}", names.join(", ")),
        }
    }
}

/// Data or a model for which no result can be computed. Every message says what to do.
#[derive(Debug, Error)]
pub enum DiscoveryError {
    /// The system rejects the data.
    #[error("{data}, for {model}: {objection}")]
    Objection {
        /// The data.
        data: String,
        /// The model.
        model: String,
        /// Reason of the rejection.
        objection: Objection,
    },
    /// Too few trajectories to hold some out.
    #[error(
        "{data}: number of trajectories with enough samples: {found}; at least 2 are needed, because effects are tested on trajectories that the fit does not use"
    )]
    TooFew {
        /// The data.
        data: String,
        /// How many there are.
        found: usize,
    },
    /// No trajectory has samples to predict.
    #[error(
        "{data}: a prediction starts from the first {known} samples of a trajectory, and {found} of the trajectories have measured samples after them; \
         at least 2 are needed to test effects: use longer trajectories, or only calibrate the model with `augsim fit`"
    )]
    NothingToPredict {
        /// The data.
        data: String,
        /// Samples that a prediction starts from.
        known: usize,
        /// Number of trajectories with later samples.
        found: usize,
    },
    /// A channel with the same value in every sample.
    #[error(
        "{data}: the column `{column}` has the same value in every sample; check the column or remove it"
    )]
    Constant {
        /// The data.
        data: String,
        /// The column.
        column: String,
    },
    /// The model declares a value for a group that the data do not have.
    #[error(
        "{model}: `{}` has a value for the group `{}`, which {data} does not contain; correct the name or remove the value ({known})",
        unknown.parameter,
        unknown.group
    )]
    UnknownGroup {
        /// The model.
        model: String,
        /// The parameter and the group.
        unknown: Box<UnknownGroup>,
        /// The data.
        data: String,
        /// Groups of the data.
        known: Groups,
    },
    /// A number of the result overflowed.
    #[error(
        "{data}: the search ended without finite numbers: `{place}` of the result is {value}. If a measurement lies far outside the range of the others (`augsim data inspect` lists the ranges), remove it; else check the calibrated model alone with `augsim fit`"
    )]
    NotFinite {
        /// The data.
        data: String,
        /// Entry of the result.
        place: &'static str,
        /// The value.
        value: f64,
    },
    /// The augmented model file cannot be read back.
    #[error(transparent)]
    RoundTripError(#[from] RoundTripError),
    /// Columns or samples that cannot be used.
    #[error("{0}")]
    Data(#[from] augsim_data::DataError),
}

impl DiscoveryError {
    /// Whether the failure is numerical, rather than a problem of the data or the model.
    pub fn is_numerical(&self) -> bool {
        matches!(self, Self::NotFinite { .. } | Self::RoundTripError(_))
    }

    pub(crate) fn unknown_group(model: &str, data: &str, unknown: UnknownGroup, known: &[String]) -> Self {
        let known = Groups(known.iter().filter(|name| !name.is_empty()).cloned().collect());
        Self::UnknownGroup { model: model.into(), unknown: Box::new(unknown), data: data.into(), known }
    }
}
