//! The hooks through which an effect takes part in a simulation.

use super::EffectSpec;
use crate::Scalar;
use crate::ball::{Covariates, Impact};

/// The ball in flight, as a force law sees it.
#[derive(Clone, Copy, Debug)]
pub struct Flight<'a, S> {
    /// Seconds since the release.
    pub time: S,
    /// Position, m.
    pub position: [S; 3],
    /// Velocity against the ground, m/s.
    pub velocity: [S; 3],
    /// Velocity against the air, m/s.
    pub airspeed: [S; 3],
    /// Spin, rad/s.
    pub spin: [S; 3],
    /// The trajectory's recorded metadata.
    pub covariates: &'a Covariates,
}

/// A state that is about to be observed.
#[derive(Clone, Copy, Debug)]
pub struct Sight<S> {
    /// Position, m; sensor laws change it.
    pub position: [S; 3],
    /// True position, m.
    pub truth: [S; 3],
    /// True velocity, m/s.
    pub velocity: [S; 3],
}

/// An effect: a term with named parameters that vanishes when they are all 0.
///
/// Every hook has a default that does nothing; an effect overrides those it needs. `p` holds the effect's parameters in
/// the order of its [`EffectSpec`].
pub trait Law<S: Scalar>: Send + Sync {
    /// Whether [`acceleration`](Law::acceleration) is used: flight then has no closed form.
    fn changes_flight(&self) -> bool {
        false
    }
    /// Acceleration that depends on nothing, m/s²; keeps the closed form of flight.
    fn constant_acceleration(&self, _p: &[S], _a: &mut [S; 3]) {}
    /// Velocity of the air, m/s.
    fn air_velocity(&self, _p: &[S], _w: &mut [S; 3]) {}
    /// Acceleration in flight, m/s², added to `a`.
    fn acceleration(&self, _p: &[S], _flight: &Flight<'_, S>, _a: &mut [S; 3]) {}
    /// Angle of the ground plane `z = x tan(angle)`, rad.
    fn ground_angle(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// The coefficient of restitution, given the one found so far.
    fn restitution(&self, _p: &[S], _impact: &Impact<'_, S>, e: S) -> S {
        e
    }
    /// Change of the tangential velocity, m/s, added to `j`.
    fn tangential(&self, _p: &[S], _impact: &Impact<'_, S>, _j: &mut [S; 3]) {}
    /// Duration of contact, s.
    fn contact_duration(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// The true spin at the release, rad/s, given the recorded one.
    fn spin(&self, _p: &[S], _spin: &mut [S; 3]) {}
    /// Delay of the measurement, s.
    fn delay(&self, _p: &[S]) -> Option<S> {
        None
    }
    /// Whether [`observe`](Law::observe) does anything.
    fn changes_sight(&self) -> bool {
        false
    }
    /// Whether [`observe`](Law::observe) uses the velocity.
    fn sees_velocity(&self) -> bool {
        false
    }
    /// Change of the measured position.
    fn observe(&self, _p: &[S], _sight: &mut Sight<S>) {}
}

/// A named effect of the library: a [`Law`] for every scalar, with its description.
pub trait Effect<S: Scalar>: Law<S> {
    /// Description of the effect: kind, place, parameters with units, sources.
    fn spec(&self) -> &'static EffectSpec;
}
