//! Error of an invalid request; every variant has the values that its message shows.
//!
//! The enums in the submodules are not errors themselves: only [`Usage`] is returned, and it decides the exit
//! code.

mod difference;
mod inapplicable;
mod missing;
mod model;
mod oversized;
mod path;
mod plan;
mod prefix;
mod unknown;
mod value;

pub use difference::Difference;
pub use inapplicable::Inapplicable;
pub use missing::Missing;
pub use model::ModelFault;
pub use oversized::Oversized;
pub use path::PathFault;
pub use plan::PlanFault;
pub use prefix::PrefixFault;
pub use unknown::UnknownName;
pub use value::{Setting, Takes};

use augsim_data::LimitExceeded;
use augsim_physics::push::laboratory::LaboratoryError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Error: a request is invalid, or contradicts the files on disk.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum Usage {
    /// A setting has an invalid value.
    #[error("{setting}: {takes}")]
    Value { setting: Setting, takes: Takes },
    /// A duration and a sampling rate give no samples, or too many.
    #[error(
        "--duration-s and --rate-hz must be positive, with 1 to {most} samples between them; {duration_s} s at {rate_hz} Hz were \
         given"
    )]
    Clock { duration_s: f64, rate_hz: f64, most: u64 },
    /// A name in the request is unknown.
    #[error("{0}")]
    Unknown(UnknownName),
    /// The request lacks a setting, data or a file.
    #[error("{0}")]
    Missing(Missing),
    /// A setting does not apply to the request.
    #[error("{0}")]
    Inapplicable(Inapplicable),
    /// The request does not support this kind of model.
    #[error("{model}: {fault}")]
    Model { model: String, fault: ModelFault },
    /// A path cannot be read or must not be written.
    #[error("{}: {fault}", path.display())]
    Path { path: PathBuf, fault: PathFault },
    /// The initial states, times or inputs of a simulation do not fit the model.
    #[error("{0}")]
    Plan(PlanFault),
    /// The observed prefix is empty, or leaves nothing to predict.
    #[error("{0}")]
    Prefix(PrefixFault),
    /// The request would produce more values than a limit allows.
    #[error("{oversized} {exceeded}")]
    Limit { oversized: Oversized, exceeded: LimitExceeded },
    /// An input given as an expression of time is invalid.
    #[error("{0}")]
    Waveform(augsim_equations::ModelError),
    /// The virtual laboratory refuses a setting.
    #[error("{0}")]
    Laboratory(LaboratoryError),
}

impl Usage {
    /// Makes the error of an option `--name` with an invalid value.
    pub fn option(name: &'static str, value: impl ToString, takes: Takes) -> Self {
        Usage::Value { setting: Setting::Option { name, value: value.to_string() }, takes }
    }

    /// Makes the error of a keyword argument `name = value` with an invalid value.
    pub fn keyword(name: &'static str, value: impl ToString, takes: Takes) -> Self {
        Usage::Value { setting: Setting::Keyword { name, value: value.to_string() }, takes }
    }

    /// Makes the error of a path that cannot be used.
    pub fn path(path: &Path, fault: PathFault) -> Self {
        Usage::Path { path: path.to_owned(), fault }
    }

    /// Makes the error of a model file, or of a model in memory with the name that the caller gave it.
    pub fn model(model: impl ToString, fault: ModelFault) -> Self {
        Usage::Model { model: model.to_string(), fault }
    }
}
