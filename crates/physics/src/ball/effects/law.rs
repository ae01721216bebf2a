//! The hooks through which an effect modifies a simulation of the ball.

use crate::Scalar;
use crate::ball::impact::Impact;
use crate::ball::state::Covariates;
use crate::library::EffectSpec;

/// State of the ball in flight, as passed to the effects that exert forces.
#[derive(Clone, Copy, Debug)]
pub struct Flight<'a, S> {
    /// Time of the state since the release, s.
    pub time: S,
    /// Position of the ball, m.
    pub position: [S; 3],
    /// Velocity of the ball relative to the ground, m/s.
    pub velocity: [S; 3],
    /// Velocity of the ball relative to the air, m/s.
    pub airspeed: [S; 3],
    /// Spin of the ball, rad/s.
    pub spin: [S; 3],
    /// Covariates of the trajectory.
    pub covariates: &'a Covariates,
}

/// A position that is about to be reported: true state and measured position.
#[derive(Clone, Copy, Debug)]
pub struct Measurement<S> {
    /// Measured position of the ball, m, which the effects on the sensor change.
    pub position: [S; 3],
    /// True position of the ball, m.
    pub truth: [S; 3],
    /// True velocity of the ball, m/s.
    pub velocity: [S; 3],
}

/// The physical law of an effect of the ball; it changes nothing at the null values of its parameters.
///
/// Every hook has a default that changes nothing; an effect overrides those it needs. `p` holds the effect's
/// parameters in the order of its [`EffectSpec`].
pub trait Law<S: Scalar>: Send + Sync {
    /// Whether the effect uses [`acceleration`](Law::acceleration), so that flight has no closed form.
    fn changes_flight(&self) -> bool {
        false
    }
    /// Adds the effect's constant acceleration to `a`, m/s²; flight keeps its closed form.
    fn constant_acceleration(&self, _p: &[S], _a: &mut [S; 3]) {}
    /// Adds the effect's velocity of the air (wind) to `w`, m/s.
    fn air_velocity(&self, _p: &[S], _w: &mut [S; 3]) {}
    /// Adds the effect's state-dependent acceleration in flight to `a`, m/s².
    fn acceleration(&self, _p: &[S], _flight: &Flight<'_, S>, _a: &mut [S; 3]) {}
    /// Angle of the ground plane `z = x tan(angle)`, rad; `None` if the effect does not tilt the ground.
    fn ground_angle(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Coefficient of restitution with the effect, given its value `e` after the preceding effects.
    fn restitution(&self, _p: &[S], _impact: &Impact<'_, S>, e: S) -> S {
        e
    }
    /// Adds the effect's change of the tangential velocity at an impact to `j`, m/s.
    fn tangential(&self, _p: &[S], _impact: &Impact<'_, S>, _j: &mut [S; 3]) {}
    /// Duration of an impact, s; `None` if the effect does not change it.
    fn contact_duration(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Replaces the recorded spin at the release by the true one according to the effect, rad/s.
    fn spin(&self, _p: &[S], _spin: &mut [S; 3]) {}
    /// Delay of the measured position, s; `None` if the effect has no delay.
    fn delay(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Whether the effect uses [`observe`](Law::observe), so that the measured position is not the true one.
    fn changes_measurement(&self) -> bool {
        false
    }
    /// Whether the effect's [`observe`](Law::observe) uses the velocity.
    fn uses_velocity(&self) -> bool {
        false
    }
    /// Changes the measured position as the effect's sensor error does.
    fn observe(&self, _p: &[S], _sight: &mut Measurement<S>) {}
}

/// An effect of the library: a [`Law`] with its description.
pub trait Effect<S: Scalar>: Law<S> {
    /// Description of the effect for discovery, model files and reports.
    fn spec(&self) -> &'static EffectSpec;
}
