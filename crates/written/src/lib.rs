//! Systems that users write as equations: model files, an expression compiler with exact derivatives, and an engine
//! that simulates many windows at once with their sensitivities.

mod dimension;
mod error;
pub mod limits;
pub mod model;
mod nearest;
pub mod text;

pub use dimension::Dimension;
pub use error::{Excerpt, Fault, ModelError, Place};
pub use model::Model;
