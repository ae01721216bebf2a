//! Independent generator of ball data with known truth.
//!
//! It shares no code with the engine under test: it has its own fine-step integrator, contact and sensor. The
//! truth is stored apart from the data, and a test reads it only after the verdict ("sealed").
#![expect(missing_docs, reason = "fields and variants are the names of what they hold")]

mod integrate;
mod make;
mod truth;

pub use make::{Sealed, model_text, seal};
pub use truth::{Kind, Scene, Truth, Unlisted, draw};
