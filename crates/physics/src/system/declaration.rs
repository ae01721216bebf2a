//! A model file as the loop sees it: what it declares, and what it becomes with what was found.

use super::{Law, Objection, ScatterPer, System};
use augsim_data::checks::Expected;
use std::error::Error as StdError;
use std::fmt::Debug;
use std::sync::Arc;
use thiserror::Error;

/// The value of a parameter after a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The value, or the values by group.
    pub values: FittedValues,
    /// 95 % interval of a single value.
    pub ci95: Option<[f64; 2]>,
}

/// One value, or one for each group.
#[derive(Clone, Debug, PartialEq)]
pub enum FittedValues {
    /// One for all.
    One(f64),
    /// Name and value of each group.
    ByGroup(Vec<(String, f64)>),
}

/// One addition of a fit to a declared model.
#[derive(Clone, Debug, PartialEq)]
pub enum Addition {
    /// A law with the values of its parameters.
    Law(Law, Vec<Fitted>),
    /// Scatter of the parameter of the schema's events, with its standard deviation.
    Scatter(ScatterPer, f64),
}

/// The outcome of a fit: values of declared parameters, and additions in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Augmentation {
    /// Session time that laws of the session clock count from, s, where the data have one.
    pub clock_reference_s: Option<f64>,
    /// Values of declared parameters, by the place of the parameter in the system's vector.
    pub declared: Vec<(usize, Fitted)>,
    /// Effects in the order in which they were added.
    pub additions: Vec<Addition>,
    /// Standard deviation of the scatter, declared or added.
    pub scatter_sd: Option<f64>,
    /// 95 % interval of that standard deviation, where it is known.
    pub scatter_ci95: Option<[f64; 2]>,
}

/// A model file that, written with what was found, does not read back as what was written.
#[derive(Debug, Error)]
#[error(
    "the model that augments {model} cannot be written so that it reads back the same{}; please report it with model and data",
    source.as_ref().map_or(String::new(), |e| format!(" ({e})"))
)]
pub struct NotReadable {
    /// The model.
    pub model: String,
    /// Why it is refused, if it is.
    pub source: Option<Box<dyn StdError + Send + Sync>>,
}

/// A model file of any system, read and checked.
pub trait Declaration: Debug + Send + Sync {
    /// Where it is from, for messages.
    fn file(&self) -> &str;

    /// Its statements about the data that it is to explain.
    fn expected(&self) -> Expected;

    /// Session time that laws of the session clock count from, s, where the model says so.
    fn clock_reference_s(&self) -> Option<f64> {
        None
    }

    /// The system that it declares, measured in a data set in which the columns are that `has` knows.
    ///
    /// # Errors
    /// Which columns are missing.
    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection>;

    /// The text of the model with what was found; reading it gives back the same model.
    ///
    /// # Errors
    /// [`NotReadable`].
    fn augmented(&self, found: &Augmentation) -> Result<String, NotReadable>;
}
