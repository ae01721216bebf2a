#![doc = include_str!("../README.md")]

mod algebra;
pub mod base_parameters;
pub mod consistency;
mod derivatives;
pub mod description;
mod error;
mod export;
mod forward_dynamics;
mod inertia;
mod inverse_dynamics;
mod joint_motion;
mod lanes;
pub mod least_squares;
mod mjcf;
mod names;
mod origins;
mod read;
mod regressor;
mod rotation;
pub mod signals;
mod structure;
#[cfg(test)]
mod test_random;
pub mod tree;
pub mod triangular_factor;
mod urdf;
mod vectors;
mod warnings;
mod xml;

pub use algebra::{Algebra, Numbers};
pub use derivatives::{TorqueDerivatives, inverse_dynamics_derivatives};
pub use description::Robot;
pub use error::DescriptionError;
pub use export::{Changes, JointChange, to_mjcf, to_urdf, write_back};
pub use forward_dynamics::{forward_dynamics, mass_matrix};
pub use inertia::{dynamic_parameters, inertia_of, moved};
pub use inverse_dynamics::inverse_dynamics;
pub use lanes::Lanes;
pub use mjcf::read_mjcf;
pub use read::read;
pub use regressor::regressor;
pub use tree::{Tree, TreeError};
pub use urdf::read_urdf;
pub use xml::MAX_FILE_BYTES;
