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

/// The value of a parameter after a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The value, or one value per group.
    pub values: FittedValues,
    /// 95 % interval, for a single value.
    pub ci95: Option<[f64; 2]>,
}

/// One value, or one value per group.
#[derive(Clone, Debug, PartialEq)]
pub enum FittedValues {
    /// One value for all groups.
    One(f64),
    /// Name and value of each group.
    ByGroup(Vec<(String, f64)>),
}

/// One effect that a fit added to the declared model.
#[derive(Clone, Debug, PartialEq)]
pub enum Addition {
    /// An effect or table with the values of its parameters.
    Term(ModelTerm, Vec<Fitted>),
    /// A random effect in the event parameter, with its standard deviation.
    Scatter(ScatterPer, f64),
}

/// The result of a fit: values of declared parameters, and added effects in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Augmentation {
    /// Reference of the session clock, s: time zero of drifting effects, where the data have session times.
    pub clock_reference_s: Option<f64>,
    /// Fitted declared parameters, each with its index in the system's parameter vector.
    pub declared: Vec<(usize, Fitted)>,
    /// Effects in the order in which they were added.
    pub additions: Vec<Addition>,
    /// Covariance of the fitted values: of the declared parameters, then of those of the effects, in their order.
    ///
    /// Zero in the row and column of a value that the data do not determine; empty where it is not known.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the random effect, declared or added.
    pub scatter_sd: Option<f64>,
    /// 95 % interval of that standard deviation, where it is known.
    pub scatter_ci95: Option<[f64; 2]>,
}

/// The error of a model file that, written with a fit result, does not read back to the same model.
#[derive(Debug, Error)]
#[error(
    "the model that augments {model} does not read back to the same model after writing{}; please report this with the model and the data",
    source.as_ref().map_or(String::new(), |e| format!(" ({e})"))
)]
pub struct RoundTripError {
    /// The model.
    pub model: String,
    /// The parse error, if there was one.
    pub source: Option<Box<dyn StdError + Send + Sync>>,
}

/// A model file of any system, parsed and checked.
pub trait Declaration: Debug + Send + Sync {
    /// Path of the file, for messages.
    fn file(&self) -> &str;

    /// Properties that it expects of the data, for plausibility checks.
    fn expected(&self) -> ExpectedData;

    /// Reference of the session clock, s, where the model declares it.
    fn clock_reference_s(&self) -> Option<f64> {
        None
    }

    /// Builds the declared system for a data set; `has` says whether the data have a column of that name.
    ///
    /// # Errors
    /// [`Objection`] names the missing columns.
    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection>;

    /// The model file's text with a fit result written into it.
    ///
    /// # Errors
    /// [`RoundTripError`] if the text does not parse back to the same model.
    fn augmented(&self, found: &Augmentation) -> Result<String, RoundTripError>;
}
