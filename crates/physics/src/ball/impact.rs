//! An impact as the laws that act in it see it, and as the engine records it.

use super::Covariates;
use crate::Scalar;

/// The instant of contact, before the laws act.
#[derive(Clone, Copy, Debug)]
pub struct Impact<'a, S> {
    /// 0 for the first impact.
    pub index: usize,
    /// Seconds since the release.
    pub time: S,
    /// Contact position, m.
    pub position: [S; 3],
    /// Approach speed along the ground's normal, m/s, positive.
    pub normal_speed: S,
    /// Velocity of the contact point along the ground, m/s: `v_t - R ω × n`.
    pub slip: [S; 3],
    /// Velocity of the ball's centre along the ground, m/s.
    pub tangential: [S; 3],
    /// Spin before the impact, rad/s.
    pub spin: [S; 3],
    /// `I / (m R²)`, 0.4 for a solid ball.
    pub inertia_ratio: S,
    /// Coefficient of restitution, once the laws for it have acted (the start value before).
    pub restitution: S,
    /// The trajectory's recorded metadata.
    pub covariates: &'a Covariates,
}

impl<S: Scalar> Impact<'_, S> {
    /// Session time of the impact relative to the session's reference time, s.
    pub fn clock(&self) -> S {
        self.time + self.covariates.clock_s
    }
}

/// One impact as it happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactRecord<S> {
    /// Seconds since the release.
    pub time: S,
    /// Contact position, m.
    pub position: [S; 3],
    /// Approach speed along the normal, m/s.
    pub speed_in: S,
    /// Departure speed along the normal, m/s; 0 when the ball came to rest.
    pub speed_out: S,
    /// Horizontal velocity of the centre before the impact, m/s.
    pub tangential: [S; 3],
    /// Slip velocity of the contact point before the impact, m/s.
    pub slip: [S; 3],
    /// Spin before the impact, rad/s.
    pub spin: [S; 3],
}
