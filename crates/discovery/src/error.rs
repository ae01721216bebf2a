//! Why a discovery cannot be made.

use augsim_physics::model::UnknownGroup;
use augsim_physics::system::{NotReadable, Objection};
use std::fmt;
use thiserror::Error;

/// The groups of a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Groups(pub Vec<String>);

/// `its groups: a, b`.
impl fmt::Display for Groups {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0[..] {
            [] => f.write_str("the data have no column `group`"),
            names => write!(f, "groups of the data: {}", names.join(", ")),
        }
    }
}

/// Data or a model with which the loop cannot be closed. Every message says what to do.
#[derive(Debug, Error)]
pub enum DiscoveryError {
    /// Objection of the system itself to the data.
    #[error("{data}, for {model}: {objection}")]
    Objection {
        /// The data.
        data: String,
        /// The model.
        model: String,
        /// Why no answer can come of them.
        objection: Objection,
    },
    /// Too few trajectories to hold some out.
    #[error(
        "{data}: {found} trajectory with enough samples; at least 2 are needed, because the gain is judged on trajectories that the fit has not seen"
    )]
    TooFew {
        /// The data.
        data: String,
        /// How many there are.
        found: usize,
    },
    /// A channel that never changes.
    #[error(
        "{data}: the column `{column}` never changes, so nothing moves in it; check the column or remove it"
    )]
    Constant {
        /// The data.
        data: String,
        /// The column.
        column: String,
    },
    /// The model has a value for a group that the data do not have.
    #[error(
        "{model}: `{}` has a value for the group `{}`, which is none of {data}; correct the name or take the value out ({known})",
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
        /// The groups that there are, in words.
        known: Groups,
    },
    /// Numbers overflowed.
    #[error(
        "{data}: `{place}` of the result came out as {value}; a measurement far beyond the others overflows the arithmetic: find it (`augsim data inspect` lists the ranges) and take it out"
    )]
    NotFinite {
        /// The data.
        data: String,
        /// Entry of the result.
        place: &'static str,
        /// The value that stands there.
        value: f64,
    },
    /// The augmented model file does not say what was found.
    #[error(transparent)]
    NotReadable(#[from] NotReadable),
    /// Velocities or positions that cannot be compared.
    #[error("{0}")]
    Data(#[from] augsim_data::DataError),
}

impl DiscoveryError {
    /// Whether numbers failed, and not the data or the model.
    pub fn is_numerical(&self) -> bool {
        matches!(self, Self::NotFinite { .. } | Self::NotReadable(_))
    }

    pub(crate) fn unknown_group(model: &str, data: &str, unknown: UnknownGroup, known: &[String]) -> Self {
        let known = Groups(known.iter().filter(|name| !name.is_empty()).cloned().collect());
        Self::UnknownGroup { model: model.into(), unknown: Box::new(unknown), data: data.into(), known }
    }
}
