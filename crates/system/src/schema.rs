//! Description of a system: names, units and roles of its states, channels, inputs and features.

use crate::effect::Effect;
use crate::quantity::Quantity;
use crate::scatter::{Scatter, ScatterPer};
use std::ops::Range;

/// How the initial value of a state is determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InitialValue {
    /// Estimated for each record.
    Free,
    /// Known: this value.
    Fixed(f64),
    /// Estimated; the channel with this index measures it.
    Measured(usize),
    /// Estimated, with a normal prior of this mean and standard deviation.
    Prior(f64, f64),
    /// Estimated, with a normal prior of this standard deviation about
    /// [`Simulate::start_mean`](crate::Simulate::start_mean).
    PriorAboutExpression(f64),
}

/// A state variable.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name and unit.
    pub quantity: Quantity,
    /// How its initial value is determined.
    pub initial: InitialValue,
}

/// A measured channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// Column of the data, with the unit as suffix.
    pub column: String,
    /// Unit as printed.
    pub unit: String,
    /// Period of a wrapped angle, in the unit of the channel.
    pub period: Option<f64>,
    /// Declared noise standard deviation, in the unit of the channel.
    pub sd: Option<f64>,
    /// Upper bound of the noise standard deviation, if known (from residuals over the shortest windows).
    pub max_sd: Option<f64>,
    /// Lower bound of the noise standard deviation: the declared accuracy of the instrument.
    ///
    /// Neighbouring samples of a marker agree better with each other than with the true position, so an
    /// estimate from their differences can be far too small.
    pub min_sd: Option<f64>,
    /// Column that marks (above 0.5) the rows with a new measurement of the channel, if there is one.
    pub update_column: Option<String>,
}

/// A difference of two values; for a quantity with a period the shortest one, from -period/2 to period/2.
pub fn shortest_difference(difference: f64, period: Option<f64>) -> f64 {
    period.map_or(difference, |period| difference - period * (difference / period).round())
}

/// Interpolation of an input between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputInterpolation {
    /// Zero-order hold: the last value.
    ZeroOrderHold,
    /// Linear interpolation (first-order hold).
    Linear,
}

/// A measured input: columns with common sample times, which may differ from those of the channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Columns of the data.
    pub columns: Vec<String>,
    /// Interpolation between its samples.
    pub interpolation: InputInterpolation,
    /// Column that marks (above 0.5) the rows with a new sample of the input, if there is one.
    pub update_column: Option<String>,
}

/// A quantity that a table can add to.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name and unit.
    pub quantity: Quantity,
    /// Where it acts (`flight`, `impact`, `sensor`, …).
    pub location: String,
    /// Whether a table there slows down every simulation.
    pub costly: bool,
    /// Typical magnitude of a relevant addition, in the unit of the quantity.
    pub typical: f64,
}

/// Channels whose errors are combined into one error figure.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorFigure {
    /// Name of the error figure (`position`, `rotation`).
    pub name: String,
    /// Channels, by index.
    pub channels: Vec<usize>,
    /// Display unit, and conversion factor from the unit of the channels.
    pub unit: (String, f64),
    /// Whether a sample's error is the Euclidean norm over the channels, not one error per channel.
    pub is_euclidean: bool,
}

/// The kind of event of a system, such as impacts.
#[derive(Clone, Debug, PartialEq)]
pub struct EventSchema {
    /// Singular and plural, for sentences.
    pub nouns: [String; 2],
    /// Index of the parameter that may have a random offset at each event.
    pub parameter: usize,
    /// That random effect as a library effect; its only parameter is the standard deviation.
    pub scatter: Effect,
    /// The random effect that the model declares.
    pub declared: Option<Scatter>,
    /// Index of the feature that scales a periodic disturbance of the parameter at events.
    pub periodic_scale_feature: Option<usize>,
}

/// Per-record random effect: parameters of an effect that vary between records about a common mean.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordRandomEffect {
    /// Index of the effect with these parameters in the library; it vanishes where they are 0.
    pub effect: usize,
    /// Indices of these parameters in the declared parameter vector, if the model declares the effect.
    pub parameters: Option<Range<usize>>,
    /// The random effect as a library effect; its only parameter is the standard deviation.
    pub scatter: Effect,
    /// The standard deviation that the model declares.
    pub declared: Option<f64>,
    /// Its 95 % interval, where the model file gives one.
    pub declared_ci95: Option<[f64; 2]>,
}

/// Description of a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schema {
    /// Name of the system.
    pub system: String,
    /// Singular and plural of a record, for sentences (`push`, `pushes`).
    pub record: [String; 2],
    /// States, in the order of a task's initial state.
    pub states: Vec<State>,
    /// Channels, in the order of the simulated values.
    pub channels: Vec<Channel>,
    /// Inputs, in the order of a record's streams.
    pub inputs: Vec<Input>,
    /// Quantities that are constant over a record, in the order of its covariates.
    pub covariates: Vec<Quantity>,
    /// Index of the covariate that is the start of the record on the session clock, s.
    pub clock: Option<usize>,
    /// Quantities that a table may depend on; residuals are also plotted against them.
    pub features: Vec<Quantity>,
    /// Quantities that a table may add to.
    pub targets: Vec<Target>,
    /// Forecast horizons, s, for a system whose states are all measured.
    pub horizons_s: Vec<f64>,
    /// Error figures; the first is the primary one.
    pub error_figures: Vec<ErrorFigure>,
    /// Kind of event, for a system that has events.
    pub event: Option<EventSchema>,
    /// Per-record random effect, for a system that has one.
    pub record_random_effect: Option<RecordRandomEffect>,
    /// Conditions that can be varied between records, most informative first (`heights`, `speeds`).
    pub conditions: Vec<String>,
}

impl Schema {
    /// Display unit of the primary error figure, and conversion factor from the unit of the channels.
    pub fn primary_unit(&self) -> (&str, f64) {
        self.error_figures.first().map_or(("", 1.0), |m| (m.unit.0.as_str(), m.unit.1))
    }

    /// Index of the covariate with this name.
    pub fn covariate(&self, name: &str) -> Option<usize> {
        self.covariates.iter().position(|c| c.name == name)
    }

    /// Index of the channel with this column.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c.column == name)
    }

    /// Indices of the states whose initial value is estimated.
    pub fn free_states(&self) -> impl Iterator<Item = usize> + '_ {
        self.states
            .iter()
            .enumerate()
            .filter(|(_, s)| !matches!(s.initial, InitialValue::Fixed(_)))
            .map(|(i, _)| i)
    }
}

impl ScatterPer {
    /// The scope's name in the system's model files, sentences and results.
    pub fn word(self, schema: &Schema) -> &str {
        match (self, &schema.event) {
            (ScatterPer::Event, Some(event)) => &event.nouns[0],
            _ => &schema.record[0],
        }
    }
}
