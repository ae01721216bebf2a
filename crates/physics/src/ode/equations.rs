//! State equations in Rust: a trait with less to implement than a full system.

use crate::Scalar;
use augsim_system::{Effect, Parameter, Schema};
use std::fmt::Debug;

/// Values at the time at which equations are evaluated: states, inputs, parameters and covariates.
#[derive(Clone, Copy, Debug)]
pub struct At<'a, S> {
    /// Time on the clock of the record, s.
    pub time: S,
    /// State values, in the order of the schema.
    pub states: &'a [S],
    /// Input values, one per input column, in the order of the schema.
    pub inputs: &'a [S],
    /// Declared parameters, then those of every library effect; null values where it is not in the model.
    pub parameters: &'a [S],
    /// Covariates of the record, in the order of the schema; NaN where not recorded.
    pub covariates: &'a [f64],
}

/// State equations with events, over any scalar; [`Ode`](super::Ode) makes a system of them.
///
/// The equations contain every candidate effect. The parameters of the effects follow the declared ones and
/// have their null values while the effect is not in the model.
pub trait Equations: Debug + Send + Sync + 'static {
    /// Description of the system: names, units, channels. Features, targets and event may be left empty.
    fn schema(&self) -> &Schema;

    /// Declared parameters of the equations.
    fn parameters(&self) -> &[Parameter];

    /// Effects that may be missing in the model, for discovery.
    fn library(&self) -> &[Effect] {
        &[]
    }

    /// Writes the time derivatives of the states, per second, to `rates`.
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]);

    /// Writes the values of the measured channels, in their units, to `channels`.
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]);

    /// Number of different events that the equations define; 0 if none.
    fn events(&self) -> usize {
        0
    }

    /// Event function of event `event`: the event happens where it falls through zero.
    fn event<S: Scalar>(&self, _event: usize, _at: &At<'_, S>) -> S {
        S::constant(1.0)
    }

    /// Changes `states` from those before event `event` to those after it.
    fn reset<S: Scalar>(&self, _event: usize, _at: &At<'_, S>, _states: &mut [S]) {}

    /// Whether the system comes to rest after event `event` and its reset.
    ///
    /// A series of ever shorter bounces (Zeno behaviour) ends only if this returns true.
    fn rests(&self, _event: usize, _at: &At<'_, f64>) -> bool {
        false
    }

    /// Writes the time derivatives of the states during the rest after event `event`; `rates` holds zeros.
    fn resting<S: Scalar>(&self, _event: usize, _at: &At<'_, S>, _rates: &mut [S]) {}

    /// Release function: the rest after event `event` ends where it falls through zero.
    ///
    /// The event itself does not happen during the rest.
    fn release<S: Scalar>(&self, _event: usize, _at: &At<'_, S>) -> S {
        S::constant(1.0)
    }
}
