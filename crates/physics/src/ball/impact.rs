//! An impact, as passed to effects and as recorded by the engine.

use super::Covariates;
use crate::Scalar;

/// The instant of contact, as passed to the effects on impacts.
#[derive(Clone, Copy, Debug)]
pub struct Impact<'a, S> {
    /// Index of the impact, 0 for the first.
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
    /// Coefficient of restitution: the base value, or the final one after all effects on it have acted.
    pub restitution: S,
    /// Covariates of the trajectory.
    pub covariates: &'a Covariates,
}

impl<S: Scalar> Impact<'_, S> {
    /// Session time of the impact, relative to the reference of the session clock, s.
    pub fn clock(&self) -> S {
        self.time + self.covariates.clock_s
    }
}

/// A simulated impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactRecord<S> {
    /// Seconds since the release.
    pub time: S,
    /// Contact position, m.
    pub position: [S; 3],
    /// Approach speed along the normal, m/s.
    pub speed_in: S,
    /// Departure speed along the normal, m/s; 0 if the ball comes to rest.
    pub speed_out: S,
    /// Velocity of the centre along the ground before the impact, m/s.
    pub tangential: [S; 3],
    /// Slip velocity of the contact point before the impact, m/s.
    pub slip: [S; 3],
    /// Spin before the impact, rad/s.
    pub spin: [S; 3],
}
