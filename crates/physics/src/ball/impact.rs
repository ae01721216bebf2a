//! An impact, as passed to effects and as recorded by the engine.

use super::Covariates;
use crate::Scalar;

/// State of the ball at an impact, as passed to the effects on impacts.
#[derive(Clone, Copy, Debug)]
pub struct Impact<'a, S> {
    /// Index of the impact in the trajectory, 0 for the first.
    pub index: usize,
    /// Time of the impact since the release, s.
    pub time: S,
    /// Position of the contact, m.
    pub position: [S; 3],
    /// Approach speed of the ball along the ground's normal, m/s, positive.
    pub normal_speed: S,
    /// Slip: velocity of the contact point along the ground, m/s, `v_t - R ω × n`.
    pub slip: [S; 3],
    /// Velocity of the ball's centre along the ground, m/s.
    pub tangential: [S; 3],
    /// Spin of the ball before the impact, rad/s.
    pub spin: [S; 3],
    /// Moment of inertia of the ball divided by `m R²`; 0.4 for a solid ball.
    pub inertia_ratio: S,
    /// Coefficient of restitution: the base value, or the final one after all effects on it have acted.
    pub restitution: S,
    /// Covariates of the trajectory.
    pub covariates: &'a Covariates,
}

impl<S: Scalar> Impact<'_, S> {
    /// Session time of the impact, s, relative to the reference time of the session clock.
    pub fn clock(&self) -> S {
        self.time + self.covariates.clock_s
    }
}

/// Record of one simulated impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactRecord<S> {
    /// Time of the impact since the release, s.
    pub time: S,
    /// Position of the contact, m.
    pub position: [S; 3],
    /// Approach speed of the ball along the ground's normal, m/s.
    pub speed_in: S,
    /// Departure speed of the ball along the ground's normal, m/s; 0 if it comes to rest.
    pub speed_out: S,
    /// Velocity of the ball's centre along the ground before the impact, m/s.
    pub tangential: [S; 3],
    /// Slip velocity of the contact point before the impact, m/s.
    pub slip: [S; 3],
    /// Spin of the ball before the impact, rad/s.
    pub spin: [S; 3],
}
