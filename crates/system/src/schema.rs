//! Description of a system: names, units and roles of its states, channels, inputs and features.

use crate::effect::Effect;
use crate::quantity::Quantity;
use crate::scatter::{Scatter, ScatterPer};
use std::ops::Range;

/// How the initial value of a state is determined: estimated (with or without a prior) or known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InitialValue {
    /// The initial value is estimated for each record.
    Free,
    /// The initial value is known: this number, in the unit of the state.
    Fixed(f64),
    /// The initial value is estimated, and the channel with this index measures it.
    Measured(usize),
    /// The initial value is estimated, with a normal prior of this mean and standard deviation.
    Prior(f64, f64),
    /// The initial value is estimated, with a normal prior of this standard deviation about
    /// [`Simulate::start_mean`](crate::Simulate::start_mean).
    PriorAboutExpression(f64),
    /// A state of an effect. Its initial value is known: a task has NaN for it, and the system computes the value
    /// from the record ([`Simulate::effect_starts`](crate::Simulate::effect_starts)).
    FromRecord,
    /// A state of an effect. Its initial value is estimated in every window, with a normal prior of this standard
    /// deviation about the value that the system computes from the record, as for [`InitialValue::FromRecord`].
    PriorAboutRecord(f64),
}

impl InitialValue {
    /// Standard deviation of the normal prior of the initial value; `None` without a prior.
    pub fn prior_sd(self) -> Option<f64> {
        match self {
            Self::Prior(_, sd) | Self::PriorAboutExpression(sd) | Self::PriorAboutRecord(sd) => Some(sd),
            Self::Free | Self::Measured(_) | Self::Fixed(_) | Self::FromRecord => None,
        }
    }
}

/// A state variable of a system.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name and unit of the state.
    pub quantity: Quantity,
    /// How the initial value of the state is determined.
    pub initial: InitialValue,
}

/// A measured channel (output) of a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// Name of the channel's data column, with the unit as suffix.
    pub column: String,
    /// Unit of the channel as printed.
    pub unit: String,
    /// Period of a channel that is a wrapped angle, in the unit of the channel; `None` for other channels.
    pub period: Option<f64>,
    /// Declared standard deviation of the channel's noise, in the unit of the channel; `None` if not declared.
    pub sd: Option<f64>,
    /// Upper bound of the noise standard deviation (from residuals over the shortest windows); `None` if not known.
    pub max_sd: Option<f64>,
    /// Lower bound of the noise standard deviation: the declared accuracy of the instrument; `None` if not declared.
    ///
    /// Neighbouring samples of a marker agree better with each other than with the true position, so an
    /// estimate from their differences can be far too small.
    pub min_sd: Option<f64>,
    /// Column that marks (above 0.5) the rows with a new measurement of the channel; `None` if there is none.
    pub update_column: Option<String>,
}

/// Shortens a difference of two values of a periodic quantity to -period/2 to period/2.
///
/// Without a period the difference is not changed.
pub fn shortest_difference(difference: f64, period: Option<f64>) -> f64 {
    period.map_or(difference, |period| difference - period * (difference / period).round())
}

/// Interpolation of an input between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputInterpolation {
    /// Zero-order hold: the input keeps its last sampled value.
    ZeroOrderHold,
    /// Linear interpolation between samples (first-order hold).
    Linear,
}

/// A measured input: columns with common sample times, which may differ from those of the channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Names of the input's data columns.
    pub columns: Vec<String>,
    /// Interpolation of the input between its samples.
    pub interpolation: InputInterpolation,
    /// Column that marks (above 0.5) the rows with a new sample of the input; `None` if there is none.
    pub update_column: Option<String>,
}

/// A quantity of the equations that a table effect can add to.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name and unit of the quantity.
    pub quantity: Quantity,
    /// Location at which the addition acts (`flight`, `impact`, `sensor`, …).
    pub location: String,
    /// Whether a table that adds to this quantity slows down every simulation.
    pub costly: bool,
    /// Typical magnitude of an addition that matters, in the unit of the quantity.
    pub typical: f64,
}

/// Channels whose errors are combined into one error figure.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorFigure {
    /// Name of the error figure (`position`, `rotation`).
    pub name: String,
    /// Indices of the channels whose errors are combined.
    pub channels: Vec<usize>,
    /// Display unit of the error figure, and conversion factor to it from the unit of the channels.
    pub unit: (String, f64),
    /// Whether a sample's error is the Euclidean norm over the channels; if not, each channel has its own error.
    pub is_euclidean: bool,
}

/// The kind of event of a system, such as impacts.
#[derive(Clone, Debug, PartialEq)]
pub struct EventSchema {
    /// Noun for the event in singular and plural, for sentences.
    pub nouns: [String; 2],
    /// Index of the event parameter, which may have a random offset at each event.
    pub parameter: usize,
    /// Random effect in the event parameter, as a library effect; its only parameter is the standard deviation.
    pub scatter: Effect,
    /// Random effect in the event parameter that the model declares; `None` if it declares none.
    pub declared: Option<Scatter>,
    /// Index of the feature that scales a periodic disturbance of the event parameter; `None` if there is none.
    pub periodic_scale_feature: Option<usize>,
}

/// Random effect per record: parameters of an effect that vary between records about a common mean.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordRandomEffect {
    /// Index in the library of the effect whose parameters vary; it vanishes where they are 0.
    pub effect: usize,
    /// Indices of the varying parameters among the declared ones; `None` if the model does not declare the effect.
    pub parameters: Option<Range<usize>>,
    /// Random effect per record, as a library effect; its only parameter is the standard deviation.
    pub scatter: Effect,
    /// Standard deviation of the random effect that the model declares; `None` if it declares none.
    pub declared: Option<f64>,
    /// 95 % interval of the declared standard deviation; `None` if the model file gives none.
    pub declared_ci95: Option<[f64; 2]>,
}

/// Description of a system: its states, channels, inputs, features and targets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schema {
    /// Name of the described system.
    pub system: String,
    /// Noun for a record in singular and plural, for sentences (`push`, `pushes`).
    pub record: [String; 2],
    /// States of the system, in the order of a task's initial state.
    pub states: Vec<State>,
    /// Measured channels of the system, in the order of the simulated values.
    pub channels: Vec<Channel>,
    /// Measured inputs of the system, in the order of a record's streams.
    pub inputs: Vec<Input>,
    /// Quantities that are constant over a record, in the order of its covariates.
    pub covariates: Vec<Quantity>,
    /// Index of the covariate that is the start of the record on the session clock, s; `None` if there is none.
    pub clock: Option<usize>,
    /// Quantities that a table may depend on; residuals are also plotted against them.
    pub features: Vec<Quantity>,
    /// Quantities to which a table may add.
    pub targets: Vec<Target>,
    /// Forecast horizons, s, of a system whose states are all measured.
    pub horizons_s: Vec<f64>,
    /// Error figures that reports list; the first is the primary one.
    pub error_figures: Vec<ErrorFigure>,
    /// Kind of event of the system, such as impacts; `None` for a system without events.
    pub event: Option<EventSchema>,
    /// Random effect per record of the system; `None` for a system without one.
    pub record_random_effect: Option<RecordRandomEffect>,
    /// Conditions of an experiment that can be varied between records, most informative first (`heights`, `speeds`).
    pub conditions: Vec<String>,
}

impl Schema {
    /// Display unit of the primary error figure, and conversion factor to it from the unit of the channels.
    pub fn primary_unit(&self) -> (&str, f64) {
        self.error_figures.first().map_or(("", 1.0), |m| (m.unit.0.as_str(), m.unit.1))
    }

    /// Index of the covariate with this name; `None` if there is none.
    pub fn covariate(&self, name: &str) -> Option<usize> {
        self.covariates.iter().position(|c| c.name == name)
    }

    /// Index of the channel whose column has this name; `None` if there is none.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c.column == name)
    }

    /// Indices of the states whose initial value is estimated.
    pub fn free_states(&self) -> impl Iterator<Item = usize> + '_ {
        self.states
            .iter()
            .enumerate()
            .filter(|(_, s)| !matches!(s.initial, InitialValue::Fixed(_) | InitialValue::FromRecord))
            .map(|(i, _)| i)
    }
}

impl ScatterPer {
    /// Name of the scope (an event or a record) in the system's model files, sentences and results.
    pub fn word(self, schema: &Schema) -> &str {
        match (self, &schema.event) {
            (ScatterPer::Event, Some(event)) => &event.nouns[0],
            _ => &schema.record[0],
        }
    }
}
