//! A sealed generator of ball data with known truth.
//!
//! It shares no code with the engine that discovers: its own fine-step integrator, its own contact, its own sensor. The
//! truth is kept apart from the data: a test asks for it only after the verdict.
#![expect(missing_docs, reason = "fields and variants are the names of what they hold")]

mod integrate;
mod make;
mod truth;

pub use make::{Sealed, model_text, seal};
pub use truth::{Kind, Scene, Truth, Unlisted, draw};
