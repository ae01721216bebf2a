//! Simulates windows of records, many at once, with their sensitivities.

mod at;
mod block;
mod diagnose;
mod failure;
mod implicit;
mod lane;
mod reference;
mod schedule;
mod signal;
mod simulate;
mod substeps;
mod task;

pub use at::{Linearised, Point};
pub use failure::SimulationError;
pub use signal::Signal;
pub use simulate::Method;
pub use substeps::ChosenSteps;
pub use task::{EventSeen, Options, Record, Seed, Simulated, Window};
