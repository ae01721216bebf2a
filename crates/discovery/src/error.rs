//! Errors of a discovery run.

use augsim_system::{Objection, RoundTripError, UnknownGroup};
use std::fmt;
use thiserror::Error;

/// Names of the groups in a data set; its text lists them for error messages.
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

/// Data or a model for which no discovery result can be computed. Every message says what to do.
#[derive(Debug, Error)]
pub enum DiscoveryError {
    /// The system of the model rejects the data.
    #[error("{data}, for {model}: {objection}")]
    Objection {
        /// Name of the data set.
        data: String,
        /// Name of the model file.
        model: String,
        /// Reason why the system rejects the data.
        objection: Objection,
    },
    /// Too few usable trajectories to test effects on trajectories that the fit does not use.
    #[error(
        "{data}: number of trajectories with enough samples: {found}; at least 2 are needed, because effects are tested on trajectories that the fit does not use"
    )]
    TooFew {
        /// Name of the data set.
        data: String,
        /// Number of trajectories with enough samples.
        found: usize,
    },
    /// Too few trajectories have measured samples after the ones that a prediction starts from.
    #[error(
        "{data}: a prediction starts from the first {known} samples of a trajectory, and {found} of the trajectories have measured samples after them; \
         at least 2 are needed to test effects: use longer trajectories, or only calibrate the model with `augsim fit`"
    )]
    NothingToPredict {
        /// Name of the data set.
        data: String,
        /// Number of first samples that a prediction starts from.
        known: usize,
        /// Number of trajectories with measured samples after those.
        found: usize,
    },
    /// A column that the model needs has the same value in every sample.
    #[error(
        "{data}: the column `{column}` has the same value in every sample; check the column or remove it"
    )]
    Constant {
        /// Name of the data set.
        data: String,
        /// Name of the constant column.
        column: String,
    },
    /// The model declares a parameter value for a group that the data do not contain.
    #[error(
        "{model}: `{}` has a value for the group `{}`, which {data} does not contain; correct the name or remove the value ({known})",
        unknown.parameter,
        unknown.group
    )]
    UnknownGroup {
        /// Name of the model file.
        model: String,
        /// The parameter, and the group that is not in the data.
        unknown: Box<UnknownGroup>,
        /// Name of the data set.
        data: String,
        /// Groups that the data contain.
        known: Groups,
    },
    /// A number of the result is not finite.
    #[error(
        "{data}: the search ended without finite numbers: `{place}` of the result is {value}. If a measurement lies far outside the range of the others (`augsim data inspect` lists the ranges), remove it; else check the calibrated model alone with `augsim fit`"
    )]
    NotFinite {
        /// Name of the data set.
        data: String,
        /// Entry of the result that contains the number.
        place: &'static str,
        /// The number that is not finite.
        value: f64,
    },
    /// The augmented model file cannot be read back after writing.
    #[error(transparent)]
    RoundTripError(#[from] RoundTripError),
    /// Columns or samples of the data cannot be used.
    #[error("{0}")]
    Data(#[from] augsim_data::DataError),
}

impl DiscoveryError {
    /// Whether the failure is numerical, rather than a problem of the data or of the model.
    pub fn is_numerical(&self) -> bool {
        matches!(self, Self::NotFinite { .. } | Self::RoundTripError(_))
    }

    pub(crate) fn unknown_group(model: &str, data: &str, unknown: UnknownGroup, known: &[String]) -> Self {
        let known = Groups(known.iter().filter(|name| !name.is_empty()).cloned().collect());
        Self::UnknownGroup { model: model.into(), unknown: Box::new(unknown), data: data.into(), known }
    }
}
