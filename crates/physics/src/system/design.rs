//! Experiments that could be made.

use super::Record;

/// An experiment: a record that has not been measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The experiment in words.
    pub text: String,
    /// Times, inputs and covariates, and one window with the state at its beginning; no values.
    pub record: Record,
    /// Events after which the record ends: later ones are too uncertain to plan with.
    pub most_events: usize,
}

/// A list of experiments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Designs {
    /// Words for the list as a whole, in the sentence "no … tells them apart".
    pub words: String,
    /// The experiments.
    pub list: Vec<Design>,
}
