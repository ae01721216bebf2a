//! A model file as data: quantities with their bounds, and expressions whose names are resolved.

mod addition;
mod check;
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
pub use read::{parse, read};
pub(crate) use row::read_all;
pub use row::{Row, RowParameter};
pub use start::FirstSamples;
use std::collections::BTreeMap;
pub(crate) use units::dimensions_of;

/// An expression and the line and key of the file where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Its tree.
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
    /// Guess of its first value, from outputs, inputs and parameters.
    pub start: Expression,
    /// Standard deviation of the guess as a prior, in the state's unit.
    pub sd: Option<f64>,
    /// Walls that the state cannot pass, in its unit.
    pub min: Option<f64>,
    /// See `min`.
    pub max: Option<f64>,
    /// Whether all trajectories begin with the same value.
    pub shared: bool,
    /// Noise of the motion, which pushes its rate.
    pub shaken: Option<Shaken>,
    /// Its change per second.
    pub rate: Expression,
    /// Line of its declaration, from 1.
    pub line: usize,
}

/// A number that wanders about 0 and is added to the rate of a state (an Ornstein-Uhlenbeck process).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaken {
    /// Standard deviation, in the unit of the rate, from sample to sample.
    pub sd: f64,
    /// Seconds in which its correlation falls to 1/e; 0 where it is anew with every sample.
    pub memory_s: f64,
}

/// How an input runs between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Each value holds until the next.
    Zero,
    /// Straight between samples.
    Linear,
    /// Natural cubic spline through the samples.
    Spline,
}

impl Hold {
    /// Its word in a model file.
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
    /// How it runs between samples; nothing where the file leaves it open.
    pub hold: Option<Hold>,
    /// Parameter that holds its delay in seconds, called `NAME.delay_s`.
    pub delay: Option<usize>,
}

/// A number of the model that can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Unit, where the name or `unit` states one.
    pub unit: Option<Unit>,
    /// Value to begin with.
    pub nominal: f64,
    /// Lower bound.
    pub min: f64,
    /// Upper bound.
    pub max: f64,
    /// Whether it stays at its nominal value.
    pub frozen: bool,
    /// Interval that a fit wrote, 95 %.
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
    /// Value.
    pub value: Expression,
}

/// Measurement noise of an output, as a fit found it: white noise plus an autocorrelated error (first order, AR(1)).
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
    /// Value that a perfect sensor reads.
    pub value: Expression,
    /// Standard deviation of the sensor; nothing where it is to be estimated.
    pub sd: Option<f64>,
    /// Noise that a fit found and wrote; forecasts use it where `sd` is to be estimated.
    pub noise: Option<SensorNoise>,
    /// Readings at or beyond these are saturated.
    pub range: Option<[f64; 2]>,
    /// Quantisation step.
    pub step: Option<f64>,
    /// Period of a quantity that wraps.
    pub period: Option<f64>,
}

/// Sense in which `when` passes 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is the direction of its name")]
pub enum Direction {
    Rising,
    Falling,
    Both,
}

/// End of a sequence of ever faster events: the system rests.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// Rests when `when` moves slower than this after the event, per second.
    pub below: f64,
    /// States that keep their value while resting. Those that the event sets are 0.
    pub hold: Vec<usize>,
    /// Condition that ends the rest: an expression of 1 or 0.
    pub until: Option<Expression>,
}

/// A sudden change of state.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Name.
    pub name: String,
    /// Fires where this passes 0.
    pub when: Expression,
    /// Sense of the passage.
    pub direction: Direction,
    /// New values: index of the state and expression of the state before.
    pub set: Vec<(usize, Expression)>,
    /// How it ends in rest.
    pub rest: Option<Rest>,
    /// Line of its declaration, from 1.
    pub line: usize,
}

/// A piecewise linear function, constant beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name.
    pub name: String,
    /// Knots, rising.
    pub at: Vec<f64>,
    /// Values at the knots.
    pub values: Vec<f64>,
    /// Unit of the values, where `unit` states one.
    pub unit: Option<Unit>,
}

/// The method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Classical Runge-Kutta of order 4.
    #[default]
    Explicit,
    /// Singly diagonally implicit Runge-Kutta of order 2, for stiff systems.
    Implicit,
}

/// How the equations are solved.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Numerics {
    /// Method.
    pub integrator: Integrator,
    /// Steps of a sample interval; nothing where they are to be chosen.
    pub substeps: Option<usize>,
    /// Widths of smoothed jumps by the text of their argument.
    pub widths: BTreeMap<String, f64>,
}

/// A system as its file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// File, or another name for where the text came from; for messages.
    pub file: String,
    /// Name of the system.
    pub name: String,
    /// States in the order of the state vector.
    pub states: Vec<State>,
    /// Inputs.
    pub inputs: Vec<Input>,
    /// Parameters in the order of the file; delays of inputs follow.
    pub parameters: Vec<Parameter>,
    /// Intermediate values, each from those before it.
    pub lets: Vec<Let>,
    /// Measured quantities.
    pub outputs: Vec<Output>,
    /// Sudden changes.
    pub events: Vec<Event>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Solver.
    pub numerics: Numerics,
    /// Effects beyond the equations, in the order in which they act.
    pub additions: Vec<Addition>,
    /// Effects of the user's own that may be tried.
    pub candidates: Vec<Row>,
    /// Text of the file, so that it can be written back with its comments.
    pub text: String,
}

impl Output {
    /// A measured value less a foretold one, by whole periods nearest to 0 where the quantity wraps.
    pub fn error(&self, measured: f64, foretold: f64) -> f64 {
        let error = measured - foretold;
        self.period.map_or(error, |period| error - period * (error / period).round())
    }
}

impl State {
    /// Makes its first value a number that is known with this standard deviation.
    pub fn set_start(&mut self, mean: f64, sd: f64) {
        self.start.tree = Tree::number(mean);
        self.sd = Some(sd);
    }
}

impl Model {
    /// Nominal values of all parameters, in order.
    pub fn nominals(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.nominal).collect()
    }

    /// Index of a state.
    pub fn state(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|s| s.name == name)
    }

    /// Index of a parameter.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }
}
