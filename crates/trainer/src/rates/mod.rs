//! Nets that correct the rates of an equation model.
//!
//! The physics advances a state over one sample interval, events included. The net predicts the mean error
//! of the force and flow equations' rates over that interval. It is trained on segments of the estimated
//! states of the training records; a part of the records is held out to choose how much of the corrections
//! to apply.

pub(crate) mod acceptance;
mod corrector;
pub(crate) mod features;
pub(crate) mod forecast;
pub(crate) mod roll_out;
pub(crate) mod split_records;

pub use features::CorrectionShrinkage;
