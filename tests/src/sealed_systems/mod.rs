//! Independent generator of data from systems of equations: eight plants, and effects that their models lack.
//!
//! Nothing here uses the engine under test: plants are integrated by a separate Runge-Kutta method with 20
//! steps per sample, and stops are located by bisection. The discovery gets a model file and a data table,
//! and the truth is read only after its answer ("sealed").

mod laws;
mod plants;
mod score;
mod simulate;

pub use laws::{Law, grammar_laws, library_laws, unlisted_laws};
pub use plants::{PLANTS, Plant};
pub use score::{Kind, Row, Summary, run, truth};
pub(crate) use simulate::runge_kutta_step;
pub use simulate::{GeneratedSet, draw};
