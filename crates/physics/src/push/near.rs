//! How a contact moved a moment ago: where the solver looks for its motion now.
//!
//! Quasi-static motion is proportional to the rod's speed, so that slip and angular velocity are kept per unit of it. Only the
//! place where Newton's method starts is taken from here, never the answer.

use super::contact::Mode;
use super::instant::Instant;
use super::planar::{Vector, norm};
use crate::Scalar;

/// The motion of a contact that sticks or slides, per unit of the rod's speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    mode: Mode,
    slip: f64,
    /// Angular velocity, 1/m.
    rotation: f64,
}

impl Near {
    /// The motion at `instant`, with the rod moving at `velocity`, m/s; `None` where the contact carries no force.
    pub fn of<S: Scalar>(instant: &Instant<S>, velocity: Vector<S>) -> Option<Self> {
        let speed = norm(velocity.map(S::value));
        let touches = matches!(instant.mode, Mode::Stick | Mode::Left | Mode::Right);
        let per_speed = |x: S| x.value() / speed;
        (touches && speed > 0.0).then(|| Self {
            mode: instant.mode,
            slip: per_speed(instant.slip),
            rotation: per_speed(instant.twist.rotation),
        })
    }

    /// Slip, m/s, and angular velocity, rad/s, of a rod at `speed`, m/s, if the contact was in `mode`.
    pub fn motion(&self, mode: Mode, speed: f64) -> Option<[f64; 2]> {
        (self.mode == mode).then_some([self.slip * speed, self.rotation * speed])
    }
}
