//! The moving bodies of a robot: links that fixed or locked joints connect are merged into one body.

mod build;
mod error;
mod singular;

use crate::description::{Placement, Robot};

pub use error::TreeError;

/// A moving joint's body: its child link, and all links that are rigidly attached to it.
///
/// The frame of the body is that of the child link.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Index of the joint in the description.
    pub joint: usize,
    /// Index of the parent body; `None` if the parent is the base.
    pub parent: Option<usize>,
    /// Placement of the body frame in the frame of the parent body (or of the base) at the joint's reference.
    pub placement: Placement,
    /// Whether the joint is prismatic; otherwise it is revolute.
    pub is_prismatic: bool,
    /// Axis of the joint in the body frame, of length 1.
    pub axis: [f64; 3],
    /// Index of the coordinate that moves the joint; coupled joints share one.
    pub coordinate: usize,
    /// Displacement of the joint from its reference = `ratio` * coordinate + `offset`.
    pub ratio: f64,
    /// Displacement of the joint where the coordinate is 0, rad or m.
    pub offset: f64,
}

/// A link of the description that belongs to a moving body.
#[derive(Debug, Clone, PartialEq)]
pub struct Attached {
    /// Index of the link in the description.
    pub link: usize,
    /// Index of the body.
    pub body: usize,
    /// Placement of the link frame in the body frame.
    pub placement: Placement,
}

/// The moving bodies of a robot, each after its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Moving bodies, each after its parent.
    pub bodies: Vec<Body>,
    /// Links that belong to moving bodies.
    pub links: Vec<Attached>,
    /// Number of coordinates: the joints that move independently.
    pub coordinates: usize,
}

impl Tree {
    /// Inertia of the rotors by coordinate, kg m2 or kg; that of a coupled joint counts with the square of its ratio.
    pub fn armature(&self, robot: &Robot) -> Vec<f64> {
        let mut armature = vec![0.0; self.coordinates];
        for body in &self.bodies {
            armature[body.coordinate] += body.ratio * body.ratio * robot.joints[body.joint].armature;
        }
        armature
    }
}
