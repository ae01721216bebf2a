#![doc = include_str!("../README.md")]

mod adam;
pub mod checkpoint;
mod gru;
mod head;
pub mod inference;
mod linear;
mod mixture;
mod mlp;
mod params;
mod schedule;
pub mod weights;

pub use adam::{Adam, AdamState};
pub use gru::Gru;
pub use head::{Gaussian, GaussianHead};
pub use linear::Linear;
pub use mixture::{MixtureHead, MixtureRunner};
pub use mlp::Mlp;
pub use params::{Bound, Init, ParamId, Params};
pub use schedule::StepDecay;
