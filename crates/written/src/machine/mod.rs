//! Runs instructions on registers of many lanes at once.

mod one;
mod run;

pub(crate) use one::evaluate;
pub(crate) use run::Machine;
