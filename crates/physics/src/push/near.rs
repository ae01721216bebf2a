//! How a contact moved a moment ago: where the solver looks for its motion now.
//!
//! Quasi-static motion is proportional to the rod's speed. Only the place where Newton's method starts is taken from here, never
//! the answer.

use super::contact::Mode;
use super::planar::{Vector, norm};

/// The motion of a contact, and that of the rod.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub mode: Mode,
    /// See [`Response::slip`](super::contact::Response::slip), m/s.
    pub slip: f64,
    /// Angular velocity, rad/s.
    pub rotation: f64,
    /// Velocity of the rod, m/s.
    pub rod: Vector<f64>,
}

impl Near {
    /// Slip, m/s, and angular velocity, rad/s, under a rod at `speed`, m/s, if the contact was in `mode` and the rod moved.
    pub fn motion(&self, mode: Mode, speed: f64) -> Option<[f64; 2]> {
        let before = norm(self.rod);
        let scaled = |x: f64| x / before * speed;
        (self.mode == mode && before > 0.0).then(|| [scaled(self.slip), scaled(self.rotation)])
    }
}
