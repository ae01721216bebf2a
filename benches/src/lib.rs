#![doc = include_str!("../README.md")]

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
