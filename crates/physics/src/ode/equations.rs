//! State equations in Rust: the small way in, for people who do not want to know records.

use crate::Scalar;
use augsim_system::{Effect, Parameter, Schema};
use std::fmt::Debug;

/// The instant at which equations are evaluated.
#[derive(Clone, Copy, Debug)]
pub struct At<'a, S> {
    /// Seconds on the record's clock.
    pub time: S,
    /// States, in the order of the schema.
    pub states: &'a [S],
    /// Columns of the inputs, in the order of the schema.
    pub inputs: &'a [S],
    /// Declared parameters, then those of every effect of the library, at their null where the effect is not in the model.
    pub parameters: &'a [S],
    /// Covariates of the record, in the order of the schema; NaN where not recorded.
    pub covariates: &'a [f64],
}

/// State equations with events, over any scalar. [`Ode`](super::Ode) makes a [`System`](augsim_system::System) of them.
///
/// The equations hold every candidate effect from the beginning: its parameters stand behind the declared ones and are at
/// their null until the effect is in the model.
pub trait Equations: Debug + Send + Sync + 'static {
    /// The description of the system. Features, targets and the event's schema may be left empty.
    fn schema(&self) -> &Schema;

    /// The declared parameters.
    fn parameters(&self) -> &[Parameter];

    /// Effects that may be missing.
    fn library(&self) -> &[Effect] {
        &[]
    }

    /// Rates of the states, per second, into `rates`.
    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]);

    /// Channels in their units, as the sensor reports them, into `channels`.
    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]);

    /// Number of events.
    fn events(&self) -> usize {
        0
    }

    /// A function that falls through zero where event `event` happens.
    fn event<S: Scalar>(&self, _event: usize, _at: &At<'_, S>) -> S {
        S::constant(1.0)
    }

    /// The states after event `event`; `states` holds those before it.
    fn reset<S: Scalar>(&self, _event: usize, _at: &At<'_, S>, _states: &mut [S]) {}

    /// Whether the system comes to rest after event `event` and its reset. A series of ever shorter hops needs this: it does
    /// not end otherwise.
    fn rests(&self, _event: usize, _at: &At<'_, f64>) -> bool {
        false
    }

    /// Rates of the states while the system rests since event `event`, into `rates`, which hold zeros.
    fn resting<S: Scalar>(&self, _event: usize, _at: &At<'_, S>, _rates: &mut [S]) {}

    /// A function that falls through zero where the rest since event `event` ends; the event itself does not happen meanwhile.
    fn release<S: Scalar>(&self, _event: usize, _at: &At<'_, S>) -> S {
        S::constant(1.0)
    }
}
