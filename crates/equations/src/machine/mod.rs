//! Runs instructions on registers of many lanes (simulated windows) at once.

mod run;
mod scalar;

pub(crate) use run::Machine;
pub(crate) use scalar::evaluate;
