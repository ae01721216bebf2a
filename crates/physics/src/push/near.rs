//! How a contact moved a moment ago: where the solver looks for its motion now.
//!
//! Quasi-static motion is proportional to the rod's speed, so that slip and angular velocity are kept per unit of it. Only the
//! place where Newton's method starts is taken from here, never the answer.

use super::contact::Mode;

/// The motion of a contact that sticks or slides, per unit of the rod's speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    mode: Mode,
    slip: f64,
    /// Angular velocity, 1/m.
    rotation: f64,
}

impl Near {
    /// The motion of a contact in `mode` with this slip, m/s, and angular velocity, rad/s, under a rod at `speed`, m/s; `None` where
    /// it carries no force.
    pub fn new(mode: Mode, [slip, rotation]: [f64; 2], speed: f64) -> Option<Self> {
        let touches = matches!(mode, Mode::Stick | Mode::Left | Mode::Right);
        (touches && speed > 0.0).then(|| Self { mode, slip: slip / speed, rotation: rotation / speed })
    }

    /// Slip, m/s, and angular velocity, rad/s, of a rod at `speed`, m/s, if the contact was in `mode`.
    pub fn motion(&self, mode: Mode, speed: f64) -> Option<[f64; 2]> {
        (self.mode == mode).then_some([self.slip * speed, self.rotation * speed])
    }
}
