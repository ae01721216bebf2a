//! Independent generator of data from systems with a hidden state: six plants, and effects with memory that
//! their models lack; and of plants without one, whose model is complete or lacks a static law.
//!
//! Nothing here uses the engine under test. The hidden state is integrated with the plant by a separate
//! Runge-Kutta method. The discovery gets a model file and a data table; truth and equivalent answers, which
//! follow from the transfer functions (see [`Memory::equivalents`]), are read only after its answer.

mod effects;
mod plants;
mod score;
mod simulate;

pub use effects::Memory;
pub use plants::{Case, MEMORY_CASES, NULL_CASES, PLANTS, Plant};
pub use score::{Row, Summary, run};
pub use simulate::draw;
