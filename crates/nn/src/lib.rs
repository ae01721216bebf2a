//! Layers, losses, optimiser, schedules, named parameters, checkpoints, and the exchange of weights with
//! PyTorch.
//!
//! Parameters live in one flat [`Params`] store under PyTorch's names. A layer holds only the ids of its
//! parameters; its forward pass takes the [`Bound`] parameters of the tape it records on. Sequences are
//! `[time, feature, batch]`.

mod adam;
pub mod checkpoint;
mod gru;
mod head;
pub mod inference;
mod linear;
mod mlp;
mod params;
mod schedule;
pub mod weights;

pub use adam::{Adam, AdamState};
pub use gru::Gru;
pub use head::{Gaussian, GaussianHead};
pub use linear::Linear;
pub use mlp::Mlp;
pub use params::{Bound, Init, ParamId, Params};
pub use schedule::StepDecay;
