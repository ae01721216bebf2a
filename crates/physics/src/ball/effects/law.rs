//! The hooks through which an effect modifies a simulation of the ball.

use crate::Scalar;
use crate::ball::impact::Impact;
use crate::ball::state::Covariates;
use crate::library::EffectSpec;

/// State of the ball in flight, as passed to force laws.
#[derive(Clone, Copy, Debug)]
pub struct Flight<'a, S> {
    /// Seconds since the release.
    pub time: S,
    /// Position, m.
    pub position: [S; 3],
    /// Velocity relative to the ground, m/s.
    pub velocity: [S; 3],
    /// Velocity relative to the air, m/s.
    pub airspeed: [S; 3],
    /// Spin, rad/s.
    pub spin: [S; 3],
    /// Covariates of the trajectory.
    pub covariates: &'a Covariates,
}

/// A state that is about to be measured.
#[derive(Clone, Copy, Debug)]
pub struct Measurement<S> {
    /// Measured position, m; sensor effects change it.
    pub position: [S; 3],
    /// True position, m.
    pub truth: [S; 3],
    /// True velocity, m/s.
    pub velocity: [S; 3],
}

/// The physical law of an effect: a term that vanishes when its parameters have their null values.
///
/// Every hook has a default that changes nothing; an effect overrides those it needs. `p` holds the effect's
/// parameters in the order of its [`EffectSpec`].
pub trait Law<S: Scalar>: Send + Sync {
    /// Whether [`acceleration`](Law::acceleration) is used, so that flight has no closed form.
    fn changes_flight(&self) -> bool {
        false
    }
    /// Adds a constant acceleration to `a`, m/s²; flight keeps its closed form.
    fn constant_acceleration(&self, _p: &[S], _a: &mut [S; 3]) {}
    /// Adds a velocity of the air to `w`, m/s.
    fn air_velocity(&self, _p: &[S], _w: &mut [S; 3]) {}
    /// Adds a state-dependent acceleration in flight to `a`, m/s².
    fn acceleration(&self, _p: &[S], _flight: &Flight<'_, S>, _a: &mut [S; 3]) {}
    /// Returns the angle of the ground plane `z = x tan(angle)`, rad.
    fn ground_angle(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Returns the coefficient of restitution, given the value `e` after the preceding effects.
    fn restitution(&self, _p: &[S], _impact: &Impact<'_, S>, e: S) -> S {
        e
    }
    /// Adds a change of the tangential velocity to `j`, m/s.
    fn tangential(&self, _p: &[S], _impact: &Impact<'_, S>, _j: &mut [S; 3]) {}
    /// Returns the duration of contact, s.
    fn contact_duration(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Replaces the recorded spin at the release by the true one, rad/s.
    fn spin(&self, _p: &[S], _spin: &mut [S; 3]) {}
    /// Returns the delay of the measurement, s.
    fn delay(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Whether [`observe`](Law::observe) is used.
    fn changes_measurement(&self) -> bool {
        false
    }
    /// Whether [`observe`](Law::observe) uses the velocity.
    fn uses_velocity(&self) -> bool {
        false
    }
    /// Changes the measured position.
    fn observe(&self, _p: &[S], _sight: &mut Measurement<S>) {}
}

/// An effect of the library: a [`Law`] with its description.
pub trait Effect<S: Scalar>: Law<S> {
    /// Description of the effect.
    fn spec(&self) -> &'static EffectSpec;
}
