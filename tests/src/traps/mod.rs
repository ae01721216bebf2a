//! Trap sets: recordings whose peculiarity is noise, logging, or a defect outside the library.
//!
//! The honest answer names no effect of the library, or the one effect that a fault of logging amounts to. Three plants are
//! simulated by a Runge-Kutta method that shares nothing with the engine, in each of the ways of [`KINDS`].
//!
//! Reading order: `kinds` (the list), `plants` (model files and rates), `draw` (from a seed to two files), `simulate`, `noise`,
//! `logging`, `judge` (when an answer is right), `run` (the battery).

mod draw;
mod judge;
mod kinds;
mod logging;
mod noise;
mod plants;
mod run;
mod simulate;

pub use draw::{Drawn, draw};
pub use judge::{Answer, Judgement, judge};
pub use kinds::{Class, Defect, KINDS, Kind, Layout, Logging, Noise, Trap};
pub use plants::{Law, PLANTS, Plant};
pub use run::{Row, Summary, chosen, run};
