//! A model file as data: quantities with their bounds, and expressions with resolved names.

mod addition;
mod check;
mod covariance;
mod effects;
mod entries;
mod equations;
mod external;
mod quantity;
mod read;
mod robot;
mod robot_properties;
mod row;
mod scope;
mod start;
mod toml_reader;
mod units;
mod write;

use crate::text::Tree;
pub use addition::{Addition, Change, Draft, DraftState, DraftTarget, How, Target};
use augsim_data::{Dimensions, Unit};
use augsim_system::NORMAL_95;
pub use covariance::Covariance;
pub use external::{External, Force};
pub use read::{parse, read};
pub use robot::{Joint, LINEAR_ENDINGS, LinkProperties, Property, RobotModel, plain_name};
pub use robot_properties::RobotProperties;
pub(crate) use row::read_all;
pub use row::{Cycle, Row, RowParameter};
pub use start::FirstSamples;
use std::collections::BTreeMap;
use std::sync::Arc;
pub(crate) use units::dimensions_of;
pub use write::with_description_file;

/// An expression of a model file, with its line and key in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Syntax tree of the expression.
    pub tree: Tree,
    /// Line of the expression in the file, from 1.
    pub line: usize,
    /// Table and key of the expression, such as `rates.omega_rad_s`.
    pub key: String,
}

/// A state of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name of the state.
    pub name: String,
    /// Unit of the state; `None` if neither the name nor `unit` states one.
    pub unit: Option<Unit>,
    /// Expression that guesses the initial value from outputs, inputs and parameters.
    pub start: Expression,
    /// Standard deviation of the initial value as a prior, in the unit of the state; `None` without a prior.
    pub sd: Option<f64>,
    /// Lower bound, which the state cannot pass, in the unit of the state; `None` without one.
    pub min: Option<f64>,
    /// Upper bound, which the state cannot pass, in the unit of the state; `None` without one.
    pub max: Option<f64>,
    /// Whether all trajectories start with the same value of the state.
    pub shared: bool,
    /// Process noise on the rate of the state; `None` if it has none.
    pub process_noise: Option<RateNoise>,
    /// Expression of the state's rate, per second.
    pub rate: Expression,
    /// Line of the state's declaration in the file, from 1.
    pub line: usize,
}

/// Process noise on the rate of a state.
///
/// It is an Ornstein-Uhlenbeck process, or white noise that changes with every sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateNoise {
    /// Standard deviation of the noise at a sample, in the unit of the rate.
    pub sd: f64,
    /// Correlation time of the noise, s; 0 if its values at different samples are independent.
    pub correlation_time_s: f64,
}

/// Interpolation of an input between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Zero-order hold: the input keeps each value until the next sample.
    Zero,
    /// Linear interpolation between samples (first-order hold).
    Linear,
    /// Interpolation by a natural cubic spline through the samples.
    Spline,
}

impl Hold {
    /// Name of the interpolation in a model file.
    pub fn word(self) -> &'static str {
        match self {
            Hold::Zero => "zero",
            Hold::Linear => "linear",
            Hold::Spline => "spline",
        }
    }
}

/// A measured input of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name of the input and of its data column.
    pub name: String,
    /// Unit of the input; `None` if neither the name nor `unit` states one.
    pub unit: Option<Unit>,
    /// Interpolation of the input between samples; `None` if the file does not state it.
    pub hold: Option<Hold>,
    /// Index of the parameter `NAME.delay_s` with the input's delay in seconds; `None` without a delay.
    pub delay: Option<usize>,
}

/// A parameter of the model, which can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter; `None` if neither the name nor `unit` states one.
    pub unit: Option<Unit>,
    /// Nominal value of the parameter, from which fits start.
    pub nominal: f64,
    /// Lower bound of the parameter.
    pub min: f64,
    /// Upper bound of the parameter.
    pub max: f64,
    /// Whether the parameter stays at its nominal value in fits.
    pub frozen: bool,
    /// 95 % confidence interval from a fit; `None` without one.
    pub ci95: Option<[f64; 2]>,
    /// Values of the parameter by group of recordings; `None` if it has one value for all groups.
    pub by_group: Option<GroupValues>,
    /// Line of the parameter's declaration in the file, from 1.
    pub line: usize,
}

/// Values of a parameter that differ between groups of recordings, such as units of one machine.
///
/// The nominal value of the parameter is then their mean.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroupValues {
    /// Name of each group with the parameter's value for it; empty before a fit.
    pub values: Vec<(String, f64)>,
    /// Standard deviation of the normal distribution over groups from which the value of another group is drawn, in
    /// the unit of the parameter; `None` if the groups show no such distribution.
    pub sd: Option<f64>,
}

impl Parameter {
    /// Sets the value to `value` within the bounds, with the 95 % interval of a normal distribution of standard deviation
    /// `sd` about it; without an interval if that has no width within the bounds.
    pub fn set_estimate(&mut self, value: f64, sd: f64) {
        self.nominal = value.clamp(self.min, self.max);
        let [low, high] = [self.nominal - NORMAL_95 * sd, self.nominal + NORMAL_95 * sd];
        let [low, high] = [low.max(self.min), high.min(self.max)];
        self.ci95 = (low < high).then_some([low, high]);
    }

    /// Value of the parameter for recordings of a group: the nominal value where the group has no value of its own.
    pub fn value_for(&self, group: Option<&str>) -> f64 {
        let values = self.by_group.iter().flat_map(|by_group| &by_group.values);
        values.into_iter().find(|(name, _)| Some(name.as_str()) == group).map_or(self.nominal, |(_, v)| *v)
    }
}

/// A named intermediate value (`[let]`), which expressions can use.
#[derive(Debug, Clone, PartialEq)]
pub struct Let {
    /// Name of the intermediate value.
    pub name: String,
    /// Dimensions of the value's expression, or else of its name; `None` if unknown.
    pub dimensions: Option<Dimensions>,
    /// Expression of the intermediate value.
    pub value: Expression,
}

/// Measurement noise of an output: white noise plus an autocorrelated error (AR(1)).
///
/// A fit has estimated both parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation of the white part of the noise, in the output's unit.
    pub white_sd: f64,
    /// Standard deviation of the autocorrelated part of the noise, in the output's unit; 0 where there is none.
    pub autocorrelated_sd: f64,
    /// Correlation time of the autocorrelated part, s: after this time the correlation has fallen to 1/e.
    pub correlation_time_s: f64,
}

impl SensorNoise {
    /// Creates white measurement noise with this standard deviation, in the output's unit.
    pub fn white(sd: f64) -> Self {
        Self { white_sd: sd, autocorrelated_sd: 0.0, correlation_time_s: 0.0 }
    }

    /// Standard deviation of the white and the autocorrelated part together, in the output's unit.
    pub fn sd(&self) -> f64 {
        self.white_sd.hypot(self.autocorrelated_sd)
    }
}

/// A measured output of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name of the output and of its data column.
    pub name: String,
    /// Unit of the output; `None` if neither the name nor `unit` states one.
    pub unit: Option<Unit>,
    /// Expression of the output without measurement noise.
    pub value: Expression,
    /// Declared standard deviation of the measurement noise, in the output's unit; `None` if it is to be estimated.
    pub sd: Option<f64>,
    /// Measurement noise that a fit has found, used if `sd` is to be estimated; `None` without a fit.
    pub noise: Option<SensorNoise>,
    /// Range of the sensor, in the output's unit; readings at or beyond its ends are saturated. `None` if unlimited.
    pub range: Option<[f64; 2]>,
    /// Quantisation step of the sensor, in the output's unit; `None` if not declared.
    pub step: Option<f64>,
    /// Period of an output that wraps, such as an angle, in the output's unit; `None` for others.
    pub period: Option<f64>,
    /// Cutoff of the zero-phase low-pass that the measured column has passed and the value passes, Hz; `None` without one.
    pub low_pass_hz: Option<f64>,
}

/// Direction in which the condition `when` of an event must cross 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is the direction of its name")]
pub enum Direction {
    Rising,
    Falling,
    Both,
}

/// Rest condition of an event: how a sequence of ever faster events (Zeno) ends with the system at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// Largest rate of change of `when`, per second, after an event at which the system comes to rest.
    pub below: f64,
    /// Indices of states that keep their value during the rest; other states that the event sets become 0.
    pub hold: Vec<usize>,
    /// Condition that ends the rest, as an expression that is 1 or 0; `None` if the rest does not end.
    pub until: Option<Expression>,
}

/// An event: an instantaneous change of states when a condition crosses 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Name of the event.
    pub name: String,
    /// Expression of the condition: the event fires when its value crosses 0.
    pub when: Expression,
    /// Direction in which `when` must cross 0 for the event to fire.
    pub direction: Direction,
    /// New values at the event: index of the state, and an expression of the states before the event.
    pub set: Vec<(usize, Expression)>,
    /// How a sequence of these events ends in a rest; `None` if it does not.
    pub rest: Option<Rest>,
    /// Line of the event's declaration in the file, from 1.
    pub line: usize,
}

/// A table: a piecewise linear function, constant beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name of the table.
    pub name: String,
    /// Arguments of the table at its knots, increasing.
    pub at: Vec<f64>,
    /// Values of the table at the knots.
    pub values: Vec<f64>,
    /// Unit of the values; `None` if `unit` states none.
    pub unit: Option<Unit>,
}

/// Integration method that a model file declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// The file declares no method: explicit steps, or implicit ones for a stiff system.
    #[default]
    Automatic,
    /// Explicit steps: classical Runge-Kutta of order 4.
    Explicit,
    /// Implicit steps: singly diagonally implicit Runge-Kutta of order 2, for stiff systems.
    Implicit,
}

/// Numerical settings of a model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Numerics {
    /// Integration method that the file declares.
    pub integrator: Integrator,
    /// Number of integration steps per sample interval; `None` if it is to be chosen.
    pub substeps: Option<usize>,
    /// Widths of smoothed discontinuities that the file declares, by the text of the argument of each.
    pub widths: BTreeMap<String, f64>,
}

/// A system of equations as its file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Name of the model file, or another name for the source of the text, for messages.
    pub file: String,
    /// Name of the modelled system.
    pub name: String,
    /// States of the system, in the order of the state vector.
    pub states: Vec<State>,
    /// Measured inputs of the system.
    pub inputs: Vec<Input>,
    /// Declared parameters in the order of the file, then the delays of inputs, then the parameters of effects.
    pub parameters: Vec<Parameter>,
    /// Named intermediate values; each uses only those before it.
    pub lets: Vec<Let>,
    /// Measured outputs of the system.
    pub outputs: Vec<Output>,
    /// Events of the system.
    pub events: Vec<Event>,
    /// Tables that expressions can use.
    pub tables: Vec<Table>,
    /// Numerical settings that the file declares.
    pub numerics: Numerics,
    /// Rigid-body dynamics of a robot; `None` if the file has no section `[robot]`.
    pub robot: Option<Arc<RobotModel>>,
    /// Function outside the file that computes rates; `None` if the file has no section `[external]`.
    pub external: Option<External>,
    /// Effects that change the equations, in the order in which they are applied.
    pub additions: Vec<Addition>,
    /// Covariance of the fitted parameters; `None` if no fit has written it.
    pub covariance: Option<Covariance>,
    /// Effects declared in the file that discovery may try.
    pub candidates: Vec<Row>,
    /// Text of the model file, so that it can be written back with its comments.
    pub text: String,
}

impl Output {
    /// Residual of the output (measured - predicted); for a wrapping quantity the smallest one modulo its period.
    pub fn error(&self, measured: f64, predicted: f64) -> f64 {
        augsim_system::shortest_difference(measured - predicted, self.period)
    }
}

impl State {
    /// Sets the initial value to `mean`, with the standard deviation `sd` as a prior.
    pub fn set_start(&mut self, mean: f64, sd: f64) {
        self.start.tree = Tree::number(mean);
        self.sd = Some(sd);
    }
}

impl Model {
    /// Names of all groups for which a parameter has a value of its own, sorted.
    pub fn group_names(&self) -> Vec<String> {
        let values = self.parameters.iter().filter_map(|p| p.by_group.as_ref()).flat_map(|g| &g.values);
        let mut names: Vec<String> = values.map(|(name, _)| name.clone()).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Nominal values of all parameters of the model, in its order.
    pub fn nominals(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.nominal).collect()
    }

    /// Index of the state that an output equals; `None` if the output's value is another expression.
    pub(crate) fn state_of_output(&self, output: usize) -> Option<usize> {
        match &self.outputs.get(output)?.value.tree.nodes[..] {
            [node] => match node.kind {
                crate::text::Kind::Symbol(crate::text::Symbol::State(state)) => Some(state),
                _ => None,
            },
            _ => None,
        }
    }

    /// Index of the state with this name; `None` if there is none.
    pub fn state(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|s| s.name == name)
    }

    /// Index of the parameter with this name; `None` if there is none.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }
}
