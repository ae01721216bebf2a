//! Trap sets: data with unusual noise, logging faults or defects, which must not be answered by an effect.
//!
//! The right answer names no effect of the library, or the one effect that is equivalent to a logging fault.
//! Three plants are simulated by a Runge-Kutta method that is independent of the engine, once for each of the
//! [`KINDS`].
//!
//! Reading order: `kinds` (the list), `plants` (model files and rates), `draw` (from a seed to two files),
//! `simulate`, `noise`, `logging`, `judge` (right answers), `run` (runs `augsim` on the sets).

mod draw;
mod judge;
mod kinds;
mod logging;
mod noise;
mod plants;
mod run;
mod simulate;

pub use draw::{GeneratedSet, draw};
pub use judge::{Answer, Judgement, judge};
pub use kinds::{Class, Defect, KINDS, Kind, Layout, Logging, Noise, Trap};
pub use plants::{Law, PLANTS, Plant};
pub use run::{Row, Summary, plant_and_kind, run};
