//! Simulates windows of records, many at once, with their sensitivities.

mod at;
mod block;
mod diagnose;
mod failure;
mod happen;
mod implicit;
mod lane;
mod reference;
mod rows;
mod run;
mod schedule;
mod sensitivity;
mod signal;
mod simulate;
mod substeps;
mod task;
mod walk;

pub use at::{Linearised, Point};
pub use failure::SimulationError;
pub use signal::Signal;
pub use simulate::Method;
pub use substeps::ChosenSteps;
pub(crate) use substeps::{Change, fastest};
pub use task::{EventSeen, Options, Record, Seed, Simulated, Window};
