//! A model file as data: quantities with their bounds, and expressions with resolved names.

mod addition;
mod check;
mod covariance;
mod effects;
mod entries;
mod equations;
mod quantity;
mod read;
mod row;
mod scope;
mod start;
mod toml_reader;
mod units;
mod write;

use crate::text::Tree;
pub use addition::{Addition, Change, Draft, DraftState, DraftTarget, How, Target};
use augsim_data::{Dimensions, Unit};
pub use covariance::Covariance;
pub use read::{parse, read};
pub(crate) use row::read_all;
pub use row::{Row, RowParameter};
pub use start::FirstSamples;
use std::collections::BTreeMap;
pub(crate) use units::dimensions_of;

/// An expression, with its line and key in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Parsed expression.
    pub tree: Tree,
    /// Line, from 1.
    pub line: usize,
    /// Table and key, such as `rates.omega_rad_s`.
    pub key: String,
}

/// A state of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name.
    pub name: String,
    /// Unit, where the name or `unit` states one.
    pub unit: Option<Unit>,
    /// Expression that guesses its start value from outputs, inputs and parameters.
    pub start: Expression,
    /// Standard deviation of the start value as a prior, in the unit of the state.
    pub sd: Option<f64>,
    /// Lower bound, which the state cannot pass, in its unit.
    pub min: Option<f64>,
    /// Upper bound, which the state cannot pass, in its unit.
    pub max: Option<f64>,
    /// Whether all trajectories start with the same value.
    pub shared: bool,
    /// Process noise on its rate.
    pub process_noise: Option<RateNoise>,
    /// Expression of its rate, per second.
    pub rate: Expression,
    /// Line of its declaration, from 1.
    pub line: usize,
}

/// Process noise on the rate of a state.
///
/// An Ornstein-Uhlenbeck process, or white noise that changes with every sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateNoise {
    /// Standard deviation of the value at a sample, in the unit of the rate.
    pub sd: f64,
    /// Correlation time, s; 0 if the values at different samples are independent.
    pub correlation_time_s: f64,
}

/// Interpolation of an input between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Zero-order hold: each value holds until the next sample.
    Zero,
    /// Linear interpolation.
    Linear,
    /// Natural cubic spline through the samples.
    Spline,
}

impl Hold {
    /// Its name in a model file.
    pub fn word(self) -> &'static str {
        match self {
            Hold::Zero => "zero",
            Hold::Linear => "linear",
            Hold::Spline => "spline",
        }
    }
}

/// A measured input.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name of the data column.
    pub name: String,
    /// Unit, where the name or `unit` states one.
    pub unit: Option<Unit>,
    /// Interpolation between samples; `None` if the file does not state it.
    pub hold: Option<Hold>,
    /// Index of the parameter with its delay in seconds, which has the name `NAME.delay_s`.
    pub delay: Option<usize>,
}

/// A number of the model that can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Unit, where the name or `unit` states one.
    pub unit: Option<Unit>,
    /// Nominal value, from which fits start.
    pub nominal: f64,
    /// Lower bound.
    pub min: f64,
    /// Upper bound.
    pub max: f64,
    /// Whether it stays at its nominal value.
    pub frozen: bool,
    /// 95 % confidence interval from a fit.
    pub ci95: Option<[f64; 2]>,
    /// Line of its declaration, from 1.
    pub line: usize,
}

/// A named intermediate value.
#[derive(Debug, Clone, PartialEq)]
pub struct Let {
    /// Name.
    pub name: String,
    /// Dimensions of its expression, or else of its name.
    pub dimensions: Option<Dimensions>,
    /// Expression of its value.
    pub value: Expression,
}

/// Measurement noise of an output: white noise plus an autocorrelated error (AR(1)).
///
/// Both were estimated by a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation of the white part, in the output's unit.
    pub white_sd: f64,
    /// Standard deviation of the autocorrelated part, in the output's unit; 0 where there is none.
    pub autocorrelated_sd: f64,
    /// Correlation time of the autocorrelated part, s: after it the correlation has fallen to 1/e.
    pub correlation_time_s: f64,
}

impl SensorNoise {
    /// White noise alone.
    pub fn white(sd: f64) -> Self {
        Self { white_sd: sd, autocorrelated_sd: 0.0, correlation_time_s: 0.0 }
    }

    /// Standard deviation of both parts together.
    pub fn sd(&self) -> f64 {
        self.white_sd.hypot(self.autocorrelated_sd)
    }
}

/// A measured quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name of the data column.
    pub name: String,
    /// Unit, where the name or `unit` states one.
    pub unit: Option<Unit>,
    /// Value without measurement noise.
    pub value: Expression,
    /// Standard deviation of the measurement noise; `None` if it is to be estimated.
    pub sd: Option<f64>,
    /// Measurement noise that a fit has found; forecasts use it if `sd` is to be estimated.
    pub noise: Option<SensorNoise>,
    /// Range of the sensor; readings at or beyond its ends are saturated.
    pub range: Option<[f64; 2]>,
    /// Quantisation step.
    pub step: Option<f64>,
    /// Period of a quantity that wraps.
    pub period: Option<f64>,
}

/// Direction in which `when` passes 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is the direction of its name")]
pub enum Direction {
    Rising,
    Falling,
    Both,
}

/// How a sequence of ever faster events ends: the system comes to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// The system rests if `when` changes more slowly than this after an event, per second.
    pub below: f64,
    /// States that keep their value during the rest; those that the event sets are 0.
    pub hold: Vec<usize>,
    /// Condition that ends the rest, as an expression that is 1 or 0.
    pub until: Option<Expression>,
}

/// An instantaneous change of states.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Name.
    pub name: String,
    /// Condition: the event fires when this passes 0.
    pub when: Expression,
    /// Direction in which `when` passes 0.
    pub direction: Direction,
    /// New values: index of the state, and an expression of the state before the event.
    pub set: Vec<(usize, Expression)>,
    /// How a sequence of these events ends in a rest.
    pub rest: Option<Rest>,
    /// Line of its declaration, from 1.
    pub line: usize,
}

/// A piecewise linear function, constant beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name.
    pub name: String,
    /// Knots, increasing.
    pub at: Vec<f64>,
    /// Values at the knots.
    pub values: Vec<f64>,
    /// Unit of the values, where `unit` states one.
    pub unit: Option<Unit>,
}

/// Integration method that a file declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Not declared: explicit, or implicit for a stiff system.
    #[default]
    Automatic,
    /// Classical Runge-Kutta of order 4.
    Explicit,
    /// Singly diagonally implicit Runge-Kutta of order 2, for stiff systems.
    Implicit,
}

/// Numerical settings of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Numerics {
    /// Integration method.
    pub integrator: Integrator,
    /// Steps per sample interval; `None` if they are to be chosen.
    pub substeps: Option<usize>,
    /// Widths of smoothed discontinuities, by the text of their argument.
    pub widths: BTreeMap<String, f64>,
}

/// A system of equations as its file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// File name, or another name for the source of the text, for messages.
    pub file: String,
    /// Name of the system.
    pub name: String,
    /// States in the order of the state vector.
    pub states: Vec<State>,
    /// Inputs.
    pub inputs: Vec<Input>,
    /// Parameters in the order of the file, followed by the delays of inputs and the parameters of effects.
    pub parameters: Vec<Parameter>,
    /// Intermediate values; each uses only those before it.
    pub lets: Vec<Let>,
    /// Measured quantities.
    pub outputs: Vec<Output>,
    /// Events.
    pub events: Vec<Event>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Numerical settings.
    pub numerics: Numerics,
    /// Effects that change the equations, in the order in which they are applied.
    pub additions: Vec<Addition>,
    /// Joint uncertainty of the fitted parameters, if a fit has written it.
    pub covariance: Option<Covariance>,
    /// Effects of the file that discovery may try.
    pub candidates: Vec<Row>,
    /// Text of the file, so that it can be written back with its comments.
    pub text: String,
}

impl Output {
    /// Residual (measured - predicted); for a wrapping quantity the smallest one modulo its period.
    pub fn error(&self, measured: f64, predicted: f64) -> f64 {
        augsim_system::shortest_difference(measured - predicted, self.period)
    }
}

impl State {
    /// Sets the start value to a number with this standard deviation as a prior.
    pub fn set_start(&mut self, mean: f64, sd: f64) {
        self.start.tree = Tree::number(mean);
        self.sd = Some(sd);
    }
}

impl Model {
    /// Nominal values of all parameters.
    pub fn nominals(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.nominal).collect()
    }

    /// The state that an output equals; `None` if its value is an expression.
    pub(crate) fn state_of_output(&self, output: usize) -> Option<usize> {
        match &self.outputs.get(output)?.value.tree.nodes[..] {
            [node] => match node.kind {
                crate::text::Kind::Symbol(crate::text::Symbol::State(state)) => Some(state),
                _ => None,
            },
            _ => None,
        }
    }

    /// Index of the state with this name.
    pub fn state(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|s| s.name == name)
    }

    /// Index of the parameter with this name.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }
}
