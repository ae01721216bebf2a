//! Libraries of effects of the built-in systems: static descriptions, and the macro that registers them.
//!
//! The effects themselves are in `ball/effects` and `push/effects`.

mod edit_distance;
pub(crate) mod registry;
mod spec;

pub(crate) use edit_distance::edit_distance;
pub use spec::{EffectSpec, Join, Location, Needs, ParameterSpec, Rival, Start};
