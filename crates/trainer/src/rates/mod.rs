//! Corrected rates: nets on what the equations of a written system leave.
//!
//! The physics advances a state over one sample interval, events included. The net says by how much the rates of force and flow
//! equations were off meanwhile. It is trained on pieces of the estimated states of the training records, a part of which is
//! held out to decide how far its corrections are trusted.

pub(crate) mod accept;
mod corrector;
pub(crate) mod features;
pub(crate) mod forecast;
pub(crate) mod pieces;
pub(crate) mod roll;

pub use features::Trust;
