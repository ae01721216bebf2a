//! A system of equations as an engine: one sample interval at a time, for many states at once.
//!
//! Nets correct the rates of force and flow equations. Where the rate of one state is another state, this
//! relation is kept. A correction d of the rate of a velocity v, over an interval h, therefore changes
//!
//! ```text
//! (1)  v by h d, and a state x with dx/dt = s v by h^2/2 s d.
//! ```

use super::error::EngineError;
use super::motion::EngineModel;
use augsim_equations::engine::{Options, Point, Record, Signal, Window};
use augsim_equations::library;
use augsim_equations::model::{Direction, Hold, Input, Integrator, Model, Output};
use augsim_equations::text::{Kind, Symbol};
use augsim_equations::{EquationSystem, System};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Name of the last action column, the time: equations may depend on it.
const TIME_COLUMN: &str = "t_s";
/// Maximum number of times that a correction which would cross an event is halved; then it is dropped.
const MAX_HALVINGS: usize = 12;

/// A system of equations at the nominal values of its parameters.
/// Configurations and checkpoints hold the file's text and the numerical settings chosen from data.
///
/// States are those of the model. Actions are the inputs at the samples (already delayed where a delay is
/// declared), the second derivatives of spline inputs, and the time.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "SerialisedEngine", into = "SerialisedEngine")]
pub struct EquationEngine {
    serialised: SerialisedEngine,
    motion: Arc<EquationMotion>,
}

/// The serialised form of an equation engine in configurations and checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SerialisedEngine {
    /// Time from one sample to the next, s.
    step_s: f64,
    /// Number of integration steps from one sample to the next.
    substeps: usize,
    /// Whether the integration method is implicit.
    implicit: bool,
    /// Standard deviation of the measurement noise of each output, in its unit.
    sensor_sd: Vec<f64>,
    /// Text of the engine's model file.
    model: String,
    /// Widths of smoothed discontinuities; the key is the text of the argument that is smoothed.
    widths: BTreeMap<String, f64>,
}

impl EquationEngine {
    /// Creates the engine of a system whose integration steps and smoothing widths suit its data.
    /// `step_s` is the time between samples in s, `sensor_sd` the measurement noise of each output in its unit.
    ///
    /// # Errors
    /// [`EngineError`] if the step is not positive, or the model cannot be serialised or compiled.
    pub fn new(system: &EquationSystem, step_s: f64, sensor_sd: Vec<f64>) -> Result<Self, EngineError> {
        Self::try_from(SerialisedEngine {
            step_s,
            substeps: system.options().substeps,
            implicit: system.is_implicit(),
            sensor_sd,
            model: system.model().to_toml().map_err(Box::new)?,
            widths: system.compiled().named_widths(),
        })
    }

    /// Text of the engine's model file.
    pub fn model(&self) -> &str {
        &self.serialised.model
    }

    /// The equation model, with the engine's integration steps and smoothing widths.
    pub fn equations(&self) -> &Model {
        self.motion.system.model()
    }

    /// Names of the action columns: inputs, second derivatives of spline inputs, and the time.
    pub fn action_columns(&self) -> &[String] {
        &self.motion.action_columns
    }

    /// Time from one sample to the next, s.
    pub fn step_s(&self) -> f64 {
        self.serialised.step_s
    }

    /// Standard deviation of the measurement noise of each output, in its unit.
    pub fn sensor_sd(&self) -> &[f64] {
        &self.serialised.sensor_sd
    }

    /// Computes outputs without noise `[row, output]` from states `[row, S]` and actions `[row, A]` of the
    /// same samples.
    pub fn outputs(&self, states: &[f64], actions: &[f64]) -> Vec<f64> {
        let a = self.motion.action_columns.len();
        self.motion.outputs(states, actions.chunks_exact(a))
    }

    pub(super) fn motion(&self) -> &EquationMotion {
        &self.motion
    }
}

impl PartialEq for EquationEngine {
    fn eq(&self, other: &Self) -> bool {
        self.serialised == other.serialised
    }
}

impl TryFrom<SerialisedEngine> for EquationEngine {
    type Error = EngineError;
    fn try_from(serialised: SerialisedEngine) -> Result<Self, EngineError> {
        let step_s = serialised.step_s;
        if !(step_s > 0.0 && step_s.is_finite()) {
            return Err(EngineError::Step { step_s });
        }
        let mut model =
            augsim_equations::model::parse(&serialised.model, "model of the run").map_err(Box::new)?;
        model.numerics.substeps = Some(serialised.substeps.max(1));
        model.numerics.widths.clone_from(&serialised.widths);
        model.numerics.integrator =
            if serialised.implicit { Integrator::Implicit } else { Integrator::Explicit };
        let motion = EquationMotion::new(&model, step_s)?;
        Ok(EquationEngine { serialised, motion: Arc::new(motion) })
    }
}

impl From<EquationEngine> for SerialisedEngine {
    fn from(engine: EquationEngine) -> Self {
        engine.serialised
    }
}

/// The compiled equation system, and the states whose rates are corrected.
#[derive(Debug)]
pub(crate) struct EquationMotion {
    system: System,
    options: Options,
    parameters: Vec<f64>,
    columns: Vec<String>,
    action_columns: Vec<String>,
    step_s: f64,
    /// Indices of the states whose rates are corrected.
    corrected: Vec<usize>,
    /// States whose rate is proportional to a corrected state: (state, index in `corrected`, rate per unit of it).
    driven: Vec<(usize, usize, f64)>,
    /// Period of each state in its unit; `None` for a state that is not periodic.
    periods: Vec<Option<f64>>,
}

impl EquationMotion {
    fn new(model: &Model, step_s: f64) -> Result<Self, EngineError> {
        let system = System::compile(model, &[]).map_err(Box::new)?;
        let options =
            Options { method: system.declared_method(), substeps: model.numerics.substeps.unwrap_or(1) };
        let mut parameters = model.nominals();
        // The inputs in the actions are delayed already, so the simulation must not delay them again.
        model.inputs.iter().filter_map(|i| i.delay).for_each(|delay| parameters[delay] = 0.0);
        let (corrected, driven) = corrected_and_driven_states(model, &system, &parameters);
        let columns = model.states.iter().map(|s| s.name.clone()).collect();
        let inputs = model.inputs.iter().map(|i| i.name.clone());
        let splines =
            model.inputs.iter().filter(|i| is_spline(i)).map(|i| format!("curvature of {}", i.name));
        let action_columns = inputs.chain(splines).chain([TIME_COLUMN.to_owned()]).collect();
        let periods = (0..model.states.len()).map(|state| state_period(model, state)).collect();
        Ok(EquationMotion {
            system,
            options,
            parameters,
            columns,
            action_columns,
            step_s,
            corrected,
            driven,
            periods,
        })
    }

    /// Number D of states whose rates are corrected.
    pub fn corrected_count(&self) -> usize {
        self.corrected.len()
    }

    /// Computes outputs without noise `[row, output]` from states `[row, S]` and the actions of each row.
    pub fn outputs<'a>(&'a self, states: &'a [f64], actions: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
        let rows = states.chunks_exact(self.columns.len()).zip(actions);
        self.system.outputs_at(rows.map(|(state, action)| self.point(state, action)))
    }

    /// Period of each output in its unit; `None` for an output that is not periodic.
    pub fn output_periods(&self) -> Vec<Option<f64>> {
        self.system.model().outputs.iter().map(|output| output.period).collect()
    }

    /// Number of inputs, which are the first action columns.
    pub fn inputs(&self) -> usize {
        self.system.model().inputs.len()
    }

    /// Index of the time among the action columns.
    fn time_index(&self) -> usize {
        self.action_columns.len() - 1
    }

    /// Period of each state in its unit; `None` for a state that is not periodic.
    pub fn periods(&self) -> &[Option<f64>] {
        &self.periods
    }

    /// Simulates one interval: states `next [row, S]` from `states [row, S]`.
    /// Actions go from `from [row, A]` to `to [row, A]`. A row whose simulation fails is NaN.
    pub fn advance(&self, states: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
        let (s, a) = (self.columns.len(), self.action_columns.len());
        let mut records: Vec<Option<Record>> = Vec::new();
        let mut record_of = Vec::with_capacity(states.len() / s);
        let mut previous: Option<(&[f64], &[f64])> = None;
        for (from, to) in from.chunks_exact(a).zip(to.chunks_exact(a)) {
            // The samples of one forecast are many rows with the same actions, which share a record.
            if previous != Some((from, to)) {
                records.push(self.interval(from, to));
                previous = Some((from, to));
            }
            record_of.push(records.len() - 1);
        }
        next.fill(f64::NAN);
        let mut rows = Vec::with_capacity(record_of.len());
        let mut windows = Vec::with_capacity(record_of.len());
        for (row, (start, record)) in states.chunks_exact(s).zip(&record_of).enumerate() {
            let Some(record) = &records[*record] else { continue };
            if start.iter().all(|x| x.is_finite()) {
                windows.push(Window { record, first: 0, last: 1, start, parameters: &self.parameters });
                rows.push(row);
            }
        }
        for (row, simulated) in rows.into_iter().zip(self.system.simulate(&windows, &[], &self.options)) {
            if let Ok(simulated) = simulated {
                next[row * s..(row + 1) * s].copy_from_slice(&simulated.end);
            }
        }
    }

    /// The inputs over one sample interval; `None` if the time at its end is not later than at its beginning.
    fn interval(&self, from: &[f64], to: &[f64]) -> Option<Record> {
        let times = [from[self.time_index()], to[self.time_index()]];
        let mut curvature = self.inputs();
        let signal = |(k, input): (usize, &Input)| {
            let values = [from[k], to[k]];
            if is_spline(input) {
                curvature += 1;
                return Signal::spline_between(times, values, [from[curvature - 1], to[curvature - 1]]);
            }
            Signal::new(&times, &values, input.hold.unwrap_or(Hold::Linear))
        };
        let signals = self.system.model().inputs.iter().enumerate().map(signal).collect();
        Record::new("an interval", times.to_vec(), signals).ok()
    }

    /// Computes the corrections of the rates, `[D]` per second, that turn the state `predicted` into `after`.
    pub fn required_corrections(&self, predicted: &[f64], after: &[f64], rates: &mut [f64]) {
        for (rate, &state) in rates.iter_mut().zip(&self.corrected) {
            *rate = (after[state] - predicted[state]) / self.step_s;
        }
    }

    /// Applies corrections `rates [D]` to the state `predicted` at the end of an interval.
    /// State bounds hold. A correction that would cross an event which the physics has not reached is
    /// shortened: the event then occurs in the next interval. `actions` are those at the end of the
    /// interval.
    pub fn correct(&self, predicted: &[f64], actions: &[f64], rates: &[f64], out: &mut [f64]) {
        self.apply_share(predicted, rates, 1.0, out);
        let events = &self.system.model().events;
        if events.is_empty() {
            return;
        }
        let conditions_at = |state: &[f64]| self.system.conditions_at([self.point(state, actions)]);
        let before = conditions_at(predicted);
        let crosses_event = |state: &[f64]| {
            let after = conditions_at(state);
            events.iter().zip(before.iter().zip(&after)).any(|(event, (before, after))| {
                let (rises, falls) = (*before <= 0.0 && *after > 0.0, *before >= 0.0 && *after < 0.0);
                match event.direction {
                    Direction::Rising => rises,
                    Direction::Falling => falls,
                    Direction::Both => rises || falls,
                }
            })
        };
        let mut share = 1.0;
        for _ in 0..MAX_HALVINGS {
            if !crosses_event(out) {
                return;
            }
            share *= 0.5;
            self.apply_share(predicted, rates, share, out);
        }
        out.copy_from_slice(predicted);
    }

    /// Adds a `share` of the corrections over an interval to a state, by formula (1), within the state bounds.
    fn apply_share(&self, predicted: &[f64], rates: &[f64], share: f64, out: &mut [f64]) {
        let h = self.step_s;
        out.copy_from_slice(predicted);
        for (rate, &state) in rates.iter().zip(&self.corrected) {
            out[state] += share * h * rate;
        }
        for &(state, by, slope) in &self.driven {
            out[state] += share * 0.5 * h * h * slope * rates[by];
        }
        for (x, state) in out.iter_mut().zip(&self.system.model().states) {
            *x = x.max(state.min.unwrap_or(f64::NEG_INFINITY)).min(state.max.unwrap_or(f64::INFINITY));
        }
    }

    fn point<'p>(&'p self, state: &'p [f64], actions: &'p [f64]) -> Point<'p> {
        let (inputs, time) = (&actions[..self.inputs()], actions[self.time_index()]);
        Point { state, inputs, parameters: &self.parameters, time }
    }
}

impl EngineModel for EquationMotion {
    fn columns(&self) -> Vec<&str> {
        self.columns.iter().map(String::as_str).collect()
    }

    fn action_columns(&self) -> Vec<&str> {
        self.action_columns.iter().map(String::as_str).collect()
    }

    fn step_s(&self) -> Option<f64> {
        Some(self.step_s)
    }

    fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
        self.advance(state, from, to, next);
    }
}

/// Whether an input is interpolated by a spline, for which its values at two samples do not suffice.
fn is_spline(input: &Input) -> bool {
    input.hold == Some(Hold::Spline)
}

/// Finds the states whose rates are force or flow equations, and the states that these drive.
/// Driven states are (state, index of the corrected state, rate per unit of that state).
fn corrected_and_driven_states(
    model: &Model,
    system: &System,
    parameters: &[f64],
) -> (Vec<usize>, Vec<(usize, usize, f64)>) {
    let declared_count = model.declared_states();
    let kinematic = kinematic_states(model);
    let corrected: Vec<usize> = (0..declared_count).filter(|s| !kinematic.contains(s)).collect();
    // The rate of a driven state is proportional to a velocity, so its derivative is the same everywhere.
    let (n, zeros) = (model.states.len(), vec![0.0; model.states.len()]);
    let inputs = vec![0.0; model.inputs.len()];
    let slopes = system.linearise(&Point { state: &zeros, inputs: &inputs, parameters, time: 0.0 }).by_state;
    let mut driven = Vec::new();
    for state in (0..declared_count).filter(|s| !corrected.contains(s)) {
        for (index, &by) in corrected.iter().enumerate() {
            let slope = slopes[state * n + by];
            if slope != 0.0 && slope.is_finite() {
                driven.push((state, index, slope));
            }
        }
    }
    (corrected, driven)
}

/// Finds the states whose rate is proportional to another state, not a force or flow equation.
/// Of two states that drive each other (an undamped oscillator) the one whose rate is exactly the other state
/// is the position.
fn kinematic_states(model: &Model) -> Vec<usize> {
    let motion = library::Kinematics::from_model(model);
    let rate_is_exactly_v = |(x, v): &(usize, usize)| matches!(&model.states[*x].rate.tree.nodes[..], [node] if node.kind == Kind::Symbol(Symbol::State(*v)));
    let (mut pairs, others): (Vec<_>, Vec<_>) = motion.pairs.into_iter().partition(rate_is_exactly_v);
    pairs.extend(others);
    let mut accepted: Vec<(usize, usize)> = Vec::new();
    for (x, v) in pairs {
        // A pair that would close a cycle is left out: no state may drive itself through others.
        let mut end = v;
        while let Some((_, next)) = accepted.iter().find(|(from, _)| *from == end) {
            end = *next;
        }
        if end != x {
            accepted.push((x, v));
        }
    }
    let is_no_flow =
        |state: usize| !motion.flows.contains(&state) && !accepted.iter().any(|(_, v)| *v == state);
    let mut kinematic: Vec<usize> = accepted.iter().map(|(x, _)| *x).collect();
    let is_paired = |state: usize| accepted.iter().any(|(x, v)| *x == state || *v == state);
    kinematic.extend((0..model.declared_states()).filter(|&s| !is_paired(s) && is_no_flow(s)));
    kinematic
}

/// Period of a state, if a periodic output is equal to it; else `None`.
fn state_period(model: &Model, state: usize) -> Option<f64> {
    let shows = |o: &&Output| matches!(&o.value.tree.nodes[..], [node] if node.kind == Kind::Symbol(Symbol::State(state)));
    model.outputs.iter().filter(shows).find_map(|o| o.period)
}

#[cfg(test)]
mod tests {
    //! Contract: required corrections invert applied ones, positions follow, and no event is crossed.
    use super::*;

    fn motion(rates: &str, events: &str) -> EquationMotion {
        let text = format!(
            "scenario = \"system\"\nname = \"s\"\n[states]\nx_m = {{ start = \"y_m\" }}\nv_m_s = {{ start = 0.0 }}\n[parameters]\n\
             k_per_s2 = 4.0\n[rates]\n{rates}[outputs]\ny_m = \"x_m\"\n{events}"
        );
        let model = augsim_equations::model::parse(&text, "model.toml").unwrap_or_else(|e| panic!("{e}"));
        EquationMotion::new(&model, 0.1).unwrap_or_else(|e| panic!("{e}"))
    }

    const OSCILLATOR: &str = "v_m_s = \"-k_per_s2 * x_m\"\nx_m = \"v_m_s\"\n";

    #[test]
    fn corrections_change_the_velocity_and_the_position_follows() {
        let motion = motion(OSCILLATOR, "");
        assert_eq!((&motion.corrected[..], &motion.driven[..]), (&[1][..], &[(0, 0, 1.0)][..]));
        let (predicted, mut after, mut rates) = ([0.2, 0.5], [0.0; 2], [0.0]);
        motion.correct(&predicted, &[0.0], &[3.0], &mut after);
        assert!((after[0] - 0.215).abs() < 1e-15 && (after[1] - 0.8).abs() < 1e-15, "{after:?}");
        motion.required_corrections(&predicted, &after, &mut rates);
        assert!((rates[0] - 3.0).abs() < 1e-12, "{rates:?}");
    }

    #[test]
    fn corrections_are_shortened_before_an_event() {
        let events = "[[events]]\nname = \"stop\"\nwhen = \"x_m - 0.3\"\ndirection = \"rising\"\nset = { v_m_s = \"-v_m_s\" }\n";
        let motion = motion(OSCILLATOR, events);
        let mut after = [0.0; 2];
        motion.correct(&[0.29, 0.0], &[0.0], &[100.0], &mut after);
        assert!(after[0] > 0.29 && after[0] <= 0.3, "{after:?}");
        motion.correct(&[0.31, 0.0], &[0.0], &[-100.0], &mut after);
        assert!(after[0] < 0.3, "downward it is passed: {after:?}");
    }
}
