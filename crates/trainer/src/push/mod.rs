//! Planar pushing: frames, features, Gaussian-process baseline, calibration, distances of point sets.
//!
//! A push is a [`crate::Sequence`] whose states are the object's pose and whose actions are the rod's
//! positions with their times, in any fixed frame. Every model has access to the first pose and the actions
//! only, computes in the frame of the first pose, and returns poses in the frame of the data.

pub mod calibrate;
pub(crate) mod features;
mod frame;
pub mod gp;
mod gp_push;
pub mod point_sets;
mod sequences;

pub use frame::StartFrame;
pub use gp_push::{GpOptions, GpPush};
pub use sequences::{Subsampling, pushes, windows};

/// State columns of a push: pose of the object.
pub const STATES: [&str; 3] = ["x_m", "y_m", "theta_rad"];
/// Action columns of a push: position of the rod, and `t_s`, the time of the sample.
pub const ACTIONS: [&str; 3] = ["pusher_x_m", "pusher_y_m", "t_s"];
