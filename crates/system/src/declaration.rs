//! Interface to the model files of all systems: declarations, and writing of fit results.

use crate::error::Objection;
use crate::model_term::ModelTerm;
use crate::scatter::ScatterPer;
use crate::system::System;
use augsim_data::checks::ExpectedData;
use std::error::Error as StdError;
use std::fmt::Debug;
use std::sync::Arc;
use thiserror::Error;

/// A fitted parameter value, with its interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Fitted value of the parameter, or one value per group of records.
    pub values: FittedValues,
    /// 95 % confidence interval of a single fitted value; `None` without one.
    pub ci95: Option<[f64; 2]>,
}

/// Fitted value of a parameter: one for all records, or one per group of records.
#[derive(Clone, Debug, PartialEq)]
pub enum FittedValues {
    /// One value of the parameter for the records of all groups.
    One(f64),
    /// One value of the parameter for the records of each group.
    ByGroup {
        /// Name of each group, and the value of the parameter for it.
        values: Vec<(String, f64)>,
        /// Standard deviation of the values over groups, in the unit of the parameter; `None` if it is not known.
        sd: Option<f64>,
    },
}

/// A library effect, table or random effect that a fit added to the declared model.
#[derive(Clone, Debug, PartialEq)]
pub enum Addition {
    /// A library effect or table, with the values of its parameters.
    Term(ModelTerm, Vec<Fitted>),
    /// A random variation of the event parameter, with its standard deviation in the unit of the parameter.
    Scatter(ScatterPer, f64),
}

/// The result of a fit, as it is written into a model file: parameter values, and added effects in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Augmentation {
    /// Reference of the session clock, s: time zero of drifting effects; `None` if the data have no session times.
    pub clock_reference_s: Option<f64>,
    /// Fitted declared parameters, each with its index in the system's parameter vector.
    pub declared: Vec<(usize, Fitted)>,
    /// Effects that the fit added, in the order in which they were added.
    pub additions: Vec<Addition>,
    /// Covariance matrix of the fitted values: declared parameters, then parameters of the effects, in order.
    ///
    /// Zero in the row and column of a value that the data do not determine; empty if the covariance is not known.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the random effect, declared or added; `None` without a random effect.
    pub scatter_sd: Option<f64>,
    /// 95 % interval of the standard deviation of the random effect; `None` if it is not known.
    pub scatter_ci95: Option<[f64; 2]>,
}

/// Error: a model file with a fit result written into it does not read back to the same model.
#[derive(Debug, Error)]
#[error(
    "the model that augments {model} does not read back to the same model after writing{}; please report this with the model and the data",
    source.as_ref().map_or(String::new(), |e| format!(" ({e})"))
)]
pub struct RoundTripError {
    /// Name of the model in the message.
    pub model: String,
    /// Parse error of the written file; `None` if it can be parsed but differs.
    pub source: Option<Box<dyn StdError + Send + Sync>>,
}

/// A model file of any system that is parsed and checked.
pub trait Declaration: Debug + Send + Sync {
    /// Path of the model file, for messages.
    fn file(&self) -> &str;

    /// Properties that the model expects of the data, for plausibility checks.
    fn expected(&self) -> ExpectedData;

    /// Reference of the session clock, s; `None` if the model does not declare it.
    fn clock_reference_s(&self) -> Option<f64> {
        None
    }

    /// Builds the declared system for a data set; `has` returns whether the data have a column of that name.
    ///
    /// # Errors
    /// [`Objection`] names the missing columns.
    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection>;

    /// Writes a fit result into the text of the model file.
    ///
    /// # Errors
    /// [`RoundTripError`] if the text does not parse back to the same model.
    fn augmented(&self, found: &Augmentation) -> Result<String, RoundTripError>;
}
