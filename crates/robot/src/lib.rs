#![doc = include_str!("../README.md")]

mod algebra;
pub mod description;
mod error;
mod forward_dynamics;
mod inertia;
mod inverse_dynamics;
mod joint_motion;
mod names;
mod origins;
mod regressor;
mod mjcf;
mod read;
mod rotation;
pub mod signals;
mod structure;
pub mod tree;
mod urdf;
mod vectors;
mod warnings;
mod xml;

pub use algebra::{Algebra, Numbers};
pub use description::Robot;
pub use error::DescriptionError;
pub use forward_dynamics::{forward_dynamics, mass_matrix};
pub use inertia::{dynamic_parameters, inertia_of, moved};
pub use inverse_dynamics::inverse_dynamics;
pub use regressor::regressor;
pub use tree::{Tree, TreeError};
pub use mjcf::read_mjcf;
pub use read::read;
pub use tree::Tree;
pub use urdf::read_urdf;
pub use urdf::read_urdf as read;
