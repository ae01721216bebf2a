//! A sealed generator of pushes with known truth.
//!
//! It shares no code with the engine that discovers: friction is that of maximum dissipation (the twist that dissipates least
//! for the motion of the contact), summed over patches or in closed form; its own contact, its own integrator, its own
//! sensor. The truth is opened only after the verdict.
#![expect(missing_docs, reason = "fields and variants are the names of what they hold")]

mod dissipation;
mod integrate;
mod make;

pub use dissipation::{Body, Surface};
pub use make::{PushKind, PushTruth, SealedPushes, draw_push, seal_pushes};
