//! Simulates many windows of records at once, with their sensitivities.

mod block;
mod diagnose;
mod discontinuity;
mod euler;
mod event_step;
mod failure;
mod implicit;
mod lane;
mod linearise;
mod reference;
mod rows;
mod run;
mod schedule;
mod sensitivity;
mod signal;
mod simulate;
mod stability;
mod substeps;
mod task;
mod widths;
mod without_states;

pub use failure::SimulationError;
pub use linearise::{Linearisation, Point};
pub use signal::Signal;
pub use simulate::Method;
pub(crate) use stability::fastest_mode;
pub use substeps::ChosenSteps;
pub(crate) use substeps::{OutputChange, TRIAL_SUBSTEPS};
pub use task::{Options, Record, Seed, Simulated, SimulatedEvent, Window};
