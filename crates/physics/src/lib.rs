#![doc = include_str!("../README.md")]

pub mod ball;
mod dual;
mod lanes;
pub mod library;
pub mod model;
pub mod ode;
pub mod push;
pub mod scalar;

pub use dual::Dual;
pub use scalar::Scalar;
