#![doc = include_str!("../README.md")]

mod algebra;
pub mod description;
pub mod signals;
pub mod tree;

pub use algebra::{Algebra, Numbers};
pub use description::Robot;
pub use tree::Tree;
