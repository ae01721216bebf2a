//! Sealed sets of systems of equations: an independent generator, eight plants, and laws that their models lack.
//!
//! Nothing here uses the engine: plants are integrated by a Runge-Kutta method of its own over a twentieth of a sample, and
//! stops are located by bisection. The loop gets a model file and a table, and the truth is opened after its answer.

mod laws;
mod plants;
mod score;
mod simulate;

pub use laws::{Law, inside, listed, outside};
pub use plants::{PLANTS, Plant};
pub use score::{Kind, Row, Summary, run, truth};
pub use simulate::{Drawn, draw};
