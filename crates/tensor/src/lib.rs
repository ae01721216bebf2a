//! Dense tensors, a reverse-mode tape and fused sequence kernels, over `f32` and `f64`.
//!
//! A [`Tape`] records operations on whole sequences. Sequence tensors are laid out
//! `[time, feature, batch]`, row-major, so that the batch lies in SIMD lanes. Every operation lives in
//! one file under `ops/` with its forward pass and its vector-Jacobian product (VJP); fused operations
//! (`gru_sequence`, `gaussian_kl`, …) have hand-written VJPs and are tested against a twin composed of
//! elementary operations.
//!
//! ```
//! use augsim_tensor::Tape;
//! let mut tape = Tape::<f64>::new();
//! let x = tape.variable(&[3], &[1.0, 2.0, 3.0])?;
//! let y = tape.mul(x, x)?;
//! let loss = tape.sum_all(y)?;
//! tape.backward(loss)?;
//! assert_eq!(tape.grad(x), &[2.0, 4.0, 6.0]);
//! # Ok::<(), augsim_tensor::TensorError>(())
//! ```
//!
//! A tape keeps its buffers when it is [reset](Tape::reset): recording the same operations on the same
//! shapes again allocates nothing.

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
