//! The error of a request that cannot be done: every variant carries the values of its message.
//!
//! The families below are no errors by themselves: only a [`Usage`] can be returned, and it decides the exit code.

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

/// A request that makes no sense, or not together with what is on disk.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum Usage {
    /// A setting has a value that it does not take.
    #[error("{setting}: {takes}")]
    Value { setting: Setting, takes: Takes },
    /// A duration and a rate that make no samples, or too many.
    #[error(
        "--duration-s and --rate-hz must be positive, with 1 to {most} samples between them; {duration_s} s at {rate_hz} Hz were \
         given"
    )]
    Clock { duration_s: f64, rate_hz: f64, most: u64 },
    /// Nothing has the name that was asked for.
    #[error("{0}")]
    Unknown(UnknownName),
    /// The request needs a setting, data or a file that it does not name.
    #[error("{0}")]
    Missing(Missing),
    /// A setting means nothing for what was asked.
    #[error("{0}")]
    Inapplicable(Inapplicable),
    /// A model is of a kind that the request does not take.
    #[error("{model}: {fault}")]
    Model { model: String, fault: ModelFault },
    /// A path leads to what cannot be read or must not be written.
    #[error("{}: {fault}", path.display())]
    Path { path: PathBuf, fault: PathFault },
    /// The starts, times or inputs of a simulation do not fit the model.
    #[error("{0}")]
    Plan(PlanFault),
    /// The rows seen of a trajectory leave nothing to forecast, or are none.
    #[error("{0}")]
    Prefix(PrefixFault),
    /// The request would make more values than a limit allows.
    #[error("{oversized} {exceeded}")]
    Limit { oversized: Oversized, exceeded: LimitExceeded },
    /// An input as a function of time is not one.
    #[error("{0}")]
    Waveform(augsim_written::ModelError),
    /// The virtual laboratory does not take a setting.
    #[error("{0}")]
    Laboratory(LaboratoryError),
}

impl Usage {
    /// The refusal of an option `--name` with a value.
    pub fn option(name: &'static str, value: impl ToString, takes: Takes) -> Self {
        Usage::Value { setting: Setting::Option { name, value: value.to_string() }, takes }
    }

    /// The refusal of a keyword of a call, `name = value`.
    pub fn keyword(name: &'static str, value: impl ToString, takes: Takes) -> Self {
        Usage::Value { setting: Setting::Keyword { name, value: value.to_string() }, takes }
    }

    /// The refusal of a path.
    pub fn path(path: &Path, fault: PathFault) -> Self {
        Usage::Path { path: path.to_owned(), fault }
    }

    /// The refusal of a model file, or of a model in memory by the name that the caller gave it.
    pub fn model(model: impl ToString, fault: ModelFault) -> Self {
        Usage::Model { model: model.to_string(), fault }
    }
}
