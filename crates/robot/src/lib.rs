#![doc = include_str!("../README.md")]

mod algebra;
pub mod description;
mod error;
mod export;
mod mjcf;
mod origins;
mod read;
mod rotation;
mod structure;
pub mod tree;
mod urdf;
mod warnings;
mod xml;

pub use algebra::{Algebra, Numbers};
pub use description::Robot;
pub use error::DescriptionError;
pub use export::{Changes, JointChange, to_mjcf, to_urdf, write_back};
pub use mjcf::read_mjcf;
pub use read::read;
pub use tree::Tree;
pub use urdf::read_urdf;
