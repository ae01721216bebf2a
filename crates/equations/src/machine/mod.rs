//! Runs instructions on registers of many lanes (simulated windows) at once.

mod external;
mod run;
mod scalar;

pub(crate) use run::Machine;
pub(crate) use scalar::evaluate;
