#![doc = include_str!("../README.md")]

mod algebra;
pub mod description;
mod error;
mod origins;
mod rotation;
mod structure;
pub mod tree;
mod urdf;
mod warnings;
mod xml;

pub use algebra::{Algebra, Numbers};
pub use description::Robot;
pub use error::DescriptionError;
pub use tree::Tree;
pub use urdf::read_urdf;
