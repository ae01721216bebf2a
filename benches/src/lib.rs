#![doc = include_str!("../README.md")]

pub mod clock;
pub mod flops;
pub mod kernels;
pub mod push;
pub mod synthetic;

/// Returns the value of a result, or stops the benchmark with the error message.
///
/// # Panics
/// If the result is an error.
pub fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}
