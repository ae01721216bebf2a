#![doc = include_str!("../README.md")]

mod algebra;
mod derivatives;
pub mod description;
mod forward_dynamics;
mod inertia;
mod inverse_dynamics;
mod joint_motion;
mod lanes;
mod names;
mod regressor;
pub mod tree;
mod vectors;

pub use algebra::{Algebra, Numbers};
pub use derivatives::{TorqueDerivatives, inverse_dynamics_derivatives};
pub use description::Robot;
pub use forward_dynamics::{forward_dynamics, mass_matrix};
pub use inertia::{dynamic_parameters, inertia_of, moved};
pub use inverse_dynamics::inverse_dynamics;
pub use lanes::Lanes;
pub use regressor::regressor;
pub use tree::{Tree, TreeError};
