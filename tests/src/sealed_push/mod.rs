//! Independent generator of data sets of pushes with known truth.
//!
//! It shares no code with the engine under test: friction follows from maximum dissipation (the twist that
//! dissipates least for the given motion of the contact), summed over patches or in closed form, with its own
//! contact, integrator and sensor. A test reads the truth only after the verdict.
#![expect(missing_docs, reason = "fields and variants are the names of what they hold")]

mod dissipation;
mod integrate;
mod make;

pub use dissipation::{Body, Surface};
pub use make::{PushKind, PushTruth, SealedPushes, draw_push, seal_pushes};
