//! Initial guess of the contact solver, from the motion of the contact at the previous evaluation.
//!
//! Quasi-static motion is proportional to the speed of the rod, so the guess is scaled by it. The guess only
//! changes where Newton's method starts, not what it converges to.

use super::contact::Mode;
use super::planar::{Vector, norm};

/// Motion of contact and rod at the previous evaluation, as initial guess of the contact solver.
#[derive(Clone, Copy, Debug)]
pub(super) struct WarmStart {
    /// Mode of the contact at the previous evaluation.
    pub mode: Mode,
    /// Slip velocity of the rod at the previous evaluation, m/s.
    pub slip: f64,
    /// Angular velocity of the object at the previous evaluation, rad/s.
    pub rotation: f64,
    /// Velocity of the rod at the previous evaluation, m/s.
    pub rod_velocity: Vector<f64>,
}

impl WarmStart {
    /// Slip, m/s, and angular velocity, rad/s, of the previous evaluation, scaled to the rod speed `speed`.
    ///
    /// `None` if the contact was in another mode than `mode` or the rod was at rest.
    pub fn scaled_motion(&self, mode: Mode, speed: f64) -> Option<[f64; 2]> {
        let previous_speed = norm(self.rod_velocity);
        let scale = |x: f64| x / previous_speed * speed;
        (self.mode == mode && previous_speed > 0.0).then(|| [scale(self.slip), scale(self.rotation)])
    }
}
