#![doc = include_str!("../README.md")]

mod bridge;
mod call_memory;
mod column_expression;
mod compile;
pub mod engine;
mod error;
mod example;
mod external;
pub mod library;
pub mod limits;
pub mod listing;
mod machine;
mod math;
pub mod model;
mod nearest;
mod system;
pub mod text;
mod waveform;

pub use bridge::{CalibratedModel, EquationSystem};
pub use column_expression::ColumnExpression;
pub use error::{Excerpt, Fault, ModelError, Place};
pub use example::{EXAMPLES, example};
pub use external::{ExternalFunction, ExternalRates};
pub use model::Model;
pub use system::System;
pub use waveform::Waveform;
