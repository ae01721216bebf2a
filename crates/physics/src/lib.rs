#![doc = include_str!("../README.md")]

pub mod ball;
mod dual;
pub mod effects;
pub mod model;
pub mod ode;
pub mod push;
pub mod scalar;
pub mod statistics;
pub mod system;

pub use dual::Dual;
pub use scalar::Scalar;
