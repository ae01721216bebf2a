//! Candidate experiments for experiment design.

use crate::record::Record;

/// A candidate experiment: a record without measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Description of the experiment, as printed in reports.
    pub text: String,
    /// Record of the experiment: times, inputs, covariates and one window with its initial state; no measured values.
    pub record: Record,
    /// Number of events after which the record ends: predictions beyond them are too uncertain for planning.
    pub max_events: usize,
}

/// A list of candidate experiments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Designs {
    /// Noun phrase for all these experiments, for the sentence "no … tells A from B".
    pub noun_phrase: String,
    /// The candidate experiments.
    pub list: Vec<Design>,
}
