//! What the benches share: clocks, work of given extents, the push net, and the figures of one machine.
//! Criterion benches lie in `benches/`, programs that print tables in `src/bin`, and the comparison with
//! PyTorch and JAX in `peers/`.

pub mod clock;
pub mod flops;
pub mod kernels;
pub mod push;
pub mod synthetic;

/// The value, or the end of the bench with its error.
///
/// # Panics
/// On an error.
pub fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}
