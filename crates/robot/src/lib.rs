#![doc = include_str!("../README.md")]

mod algebra;
pub mod base_parameters;
pub mod consistency;
pub mod description;
pub mod least_squares;
pub mod signals;
#[cfg(test)]
mod test_random;
pub mod tree;
pub mod triangular_factor;

pub use algebra::{Algebra, Numbers};
pub use description::Robot;
pub use tree::Tree;
