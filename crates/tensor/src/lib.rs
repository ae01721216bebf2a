#![doc = include_str!("../README.md")]

mod error;
pub mod kernels;
mod ops;
mod pool;
mod scalar;
mod shape;
pub mod simd;
mod tape;

pub use error::TensorError;
pub use ops::OPERATIONS;
pub use ops::gru_sequence::GruVars;
pub use scalar::Scalar;
pub use shape::{MAX_RANK, Shape};
pub use tape::{Mark, Tape, Var};
