//! A compiled model: instructions for rates, outputs, events and resets, with their derivatives.

use crate::compile::{
    Code, Derivatives, Graph, Id, Layout, Lowering, Probe, Section, Smoothing, Variable, Width,
};
use crate::error::{Fault, ModelError, Place};
use crate::limits::MAX_STABLE_SUBSTEPS;
use crate::machine::Machine;
use crate::model::{Cycle, Direction, Model};
use std::collections::BTreeMap;

/// A compiled system, which simulates windows with their derivatives.
///
/// The derivatives are with respect to start states and selected parameters.
#[derive(Debug, Clone)]
pub struct System {
    pub(crate) model: Model,
    /// Parameters with respect to which derivatives are computed, as indices into those of the model.
    pub(crate) active: Vec<usize>,
    pub(crate) machine: Machine,
    pub(crate) layout: Layout,
    /// Instructions for values that depend on parameters alone; run once per simulation.
    pub(crate) parameter_section: Section,
    pub(crate) rates: Section,
    pub(crate) rate_gradient: Gradient,
    pub(crate) outputs: Section,
    pub(crate) output_gradient: Gradient,
    /// Instructions for the conditions: all `when`, then all `until` of events (positive where they hold).
    pub(crate) conditions: Section,
    pub(crate) condition_gradients: Vec<Gradient>,
    pub(crate) resets: Vec<Gradient>,
    /// For each event, the index in `conditions` of the condition that ends its rest; `None` if it has none.
    pub(crate) rest_ends: Vec<Option<usize>>,
    /// Instructions for the arguments of smoothed discontinuities, from which their widths are chosen.
    pub(crate) discontinuity_arguments: Section,
    /// Widths of smoothed discontinuities, in the unit of their arguments.
    pub(crate) widths: Vec<f64>,
    /// Texts, in the model, of the arguments of the smoothed discontinuities.
    pub(crate) width_texts: Vec<String>,
    /// For each smoothed discontinuity, whether the model file declares its width.
    pub(crate) declared_widths: Vec<bool>,
    /// Register of each compiled `[let]` value, with the index of that value in the model.
    pub(crate) let_registers: Vec<(u32, usize)>,
    /// Maximum number of explicit steps per sample interval; a window that needs more for stability fails.
    pub(crate) max_stable_substeps: usize,
    /// Periods and frequencies of added effects, which the steps resolve.
    pub(crate) cycles: Vec<CycleRate>,
}

/// Maximum number of periodic effects whose cycles the steps resolve. Many are only compared with each other, in periodograms.
const MAX_RESOLVED_CYCLES: usize = 4;

/// How fast an added periodic effect passes through its cycles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CycleRate {
    /// Index of the period or frequency in the parameters of the model.
    pub(crate) parameter: usize,
    pub(crate) cycle: Cycle,
    /// Largest speed in the data of the quantity that the period belongs to, per second.
    pub(crate) speed: f64,
}

/// Instructions for several values and their derivatives that are not always 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Gradient {
    /// Instructions whose results are the values, then the derivative of each entry.
    pub(crate) section: Section,
    pub(crate) entries: Vec<Entry>,
}

/// One derivative in a gradient: that of value number `row` with respect to `column`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) row: usize,
    pub(crate) column: Column,
    /// Whether the derivative is the constant 1.
    pub(crate) is_one: bool,
    /// Register that holds the derivative.
    pub(crate) register: usize,
}

/// The variable with respect to which a derivative in a gradient is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Column {
    State(usize),
    /// An active parameter, by its index among the parameters with derivatives.
    Active(usize),
    Time,
}

/// Width of a smoothed discontinuity before one is declared or chosen from a simulation.
///
/// In the unit of its argument.
const DEFAULT_WIDTH: f64 = 0.01;

/// Checks that only outputs of a model without states pass a low-pass.
fn check_low_pass(model: &Model) -> Result<(), ModelError> {
    let Some(output) = model.outputs.iter().find(|o| o.low_pass_hz.is_some() && !model.states.is_empty())
    else {
        return Ok(());
    };
    let (line, key) = (output.value.line, format!("outputs.{}.low_pass_hz", output.name));
    let place = Place { file: model.file.clone(), line, key };
    Err(ModelError { place, fault: Box::new(Fault::LowPassWithStates), excerpt: None })
}

/// Operations that compute several values, and the (row, variable, derivative) entries of their gradient.
type ResultsWithGradient = (Vec<Id>, Vec<(usize, Variable, Id)>);

impl System {
    /// Compiles a model, with derivatives with respect to start states and the parameters `active`.
    ///
    /// `active` has indices into the parameters of the model.
    ///
    /// # Errors
    /// [`Fault::TooLarge`] if it needs more operations than are allowed, [`Fault::FiresForever`] for an event
    /// that does not end its own condition.
    pub fn compile(model: &Model, active: &[usize]) -> Result<System, ModelError> {
        check_low_pass(model)?;
        if let Some(external) = model.external.as_ref().filter(|external| external.rates.is_none()) {
            return Err(external.missing(model));
        }
        let mut lowering = Lowering::new(model);
        let (rates, outputs) = (lowering.rates(), lowering.outputs());
        let (conditions, resets, rest_ends) = lower_events(model, &mut lowering);
        let Lowering { mut graph, widths, let_ids, .. } = lowering;
        check_events(model, &graph, &rates, &conditions, &resets)?;
        let delays = model.inputs.iter().map(|i| i.delay).collect();
        let mut derivatives = Derivatives::new(active, delays);
        let mut differentiate = |graph: &mut Graph, ids: &[Id], with_time: bool| {
            gradient(&mut derivatives, graph, ids, with_time)
        };
        let rate_results = differentiate(&mut graph, &rates, false);
        let output_results = differentiate(&mut graph, &outputs, false);
        let condition_results: Vec<ResultsWithGradient> =
            conditions.iter().map(|id| differentiate(&mut graph, &[*id], true)).collect();
        let mut reset_results = Vec::new();
        for set in &resets {
            let values: Vec<Id> = (0..model.states.len())
                .map(|state| {
                    let assigned = set.iter().rev().find(|(s, _)| *s == state).map(|(_, id)| *id);
                    assigned.unwrap_or_else(|| graph.leaf(Code::State, state))
                })
                .collect();
            reset_results.push(differentiate(&mut graph, &values, true));
        }
        if graph.is_too_large() {
            let place = Place { file: model.file.clone(), line: 1, key: String::new() };
            return Err(ModelError { place, fault: Box::new(Fault::TooLarge), excerpt: None });
        }
        let flat = |wanted: &ResultsWithGradient| -> Vec<Id> {
            wanted.0.iter().copied().chain(wanted.1.iter().map(|(_, _, id)| *id)).collect()
        };
        let discontinuity_arguments: Vec<Id> = widths.iter().map(|w| w.argument).collect();
        let mut wanted = vec![
            rates,
            outputs,
            conditions,
            discontinuity_arguments,
            flat(&rate_results),
            flat(&output_results),
        ];
        wanted.extend(condition_results.iter().map(flat));
        wanted.extend(reset_results.iter().map(flat));
        let sizes = (model.states.len(), model.inputs.len(), model.parameters.len(), widths.len());
        let (layout, parameter_section, sections) = Layout::assign(sizes, &graph, &wanted);
        let mut sections = sections.into_iter();
        let mut next = || sections.next().unwrap_or_default();
        let [rates, outputs, conditions, discontinuity_arguments] = [next(), next(), next(), next()];
        let mut complete =
            |wanted: &ResultsWithGradient| Gradient::new(next(), wanted, &graph, &layout, active);
        Ok(System {
            rate_gradient: complete(&rate_results),
            output_gradient: complete(&output_results),
            condition_gradients: condition_results.iter().map(&mut complete).collect(),
            resets: reset_results.iter().map(&mut complete).collect(),
            model: model.clone(),
            active: active.to_vec(),
            machine: Machine::new(model),
            parameter_section,
            rates,
            outputs,
            conditions,
            rest_ends,
            discontinuity_arguments,
            widths: widths.iter().map(|w| w.declared.unwrap_or(DEFAULT_WIDTH)).collect(),
            width_texts: widths.iter().map(|w| w.text.clone()).collect(),
            declared_widths: widths.iter().map(|w: &Width| w.declared.is_some()).collect(),
            let_registers: let_ids
                .iter()
                .filter_map(|(id, index)| Some((layout.assigned_register(*id)?, *index)))
                .collect(),
            max_stable_substeps: MAX_STABLE_SUBSTEPS,
            cycles: Vec::new(),
            layout,
        })
    }

    /// The model that this system was compiled from.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Parameters with respect to which derivatives are computed, as indices into those of the model.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// Number of operations for the rates alone, and for the rates with their derivatives.
    ///
    /// For reports and benchmarks.
    pub fn operations(&self) -> (usize, usize) {
        (self.rates.body.len(), self.rate_gradient.section.body.len())
    }

    /// Widths of smoothed discontinuities, in the units of their arguments.
    ///
    /// They are in the order of their first use in the rates.
    pub fn widths(&self) -> &[f64] {
        &self.widths
    }

    /// Widths of smoothed discontinuities, by the text of the argument of each, as a model file names them.
    pub fn named_widths(&self) -> BTreeMap<String, f64> {
        self.width_texts.iter().cloned().zip(self.widths.iter().copied()).collect()
    }

    /// Copies the widths of smoothed discontinuities from `other` for all arguments they share.
    ///
    /// The widths of `other` were chosen from data.
    pub(crate) fn with_widths_of(mut self, other: &System) -> System {
        for (text, width) in self.width_texts.iter().zip(&mut self.widths) {
            if let Some(index) = other.width_texts.iter().position(|t| t == text) {
                *width = other.widths[index];
            }
        }
        self
    }

    /// Limits the number of explicit steps per sample interval.
    pub(crate) fn with_max_stable_substeps(mut self, max_stable_substeps: usize) -> System {
        self.max_stable_substeps = max_stable_substeps;
        self
    }

    /// Lets the steps resolve the cycles of added effects.
    pub(crate) fn with_cycles(mut self, cycles: Vec<CycleRate>) -> System {
        self.cycles = cycles;
        self
    }

    /// Angular rate of the fastest cycle of added effects, rad/s; 0 without one, and where many effects are tried at once.
    pub(crate) fn cycle_rate(&self, parameters: &[f64]) -> f64 {
        if self.cycles.len() > MAX_RESOLVED_CYCLES {
            return 0.0;
        }
        let rate = |c: &CycleRate| match (c.cycle, parameters[c.parameter].abs()) {
            (Cycle::Period, period) => std::f64::consts::TAU * c.speed / period,
            (Cycle::Frequency, frequency) => frequency,
        };
        self.cycles.iter().map(rate).filter(|rate| rate.is_finite()).fold(0.0, f64::max)
    }

    /// Number of states of the model.
    pub(crate) fn states(&self) -> usize {
        self.model.states.len()
    }

    /// Whether the model has neither events nor state bounds, so that all lanes can step together.
    pub(crate) fn is_smooth(&self) -> bool {
        let has_bound = |s: &crate::model::State| s.min.is_some() || s.max.is_some();
        self.model.events.is_empty() && !self.model.states.iter().any(has_bound)
    }
}

/// Compiled events: conditions, new values of the states that each event sets, and indices of rest ends.
///
/// The conditions are all `when`, then all `until`; an index is that of the event's `until` among them.
type LoweredEvents = (Vec<Id>, Vec<Vec<(usize, Id)>>, Vec<Option<usize>>);

/// Compiles conditions and resets of the events, without smoothing.
fn lower_events(model: &Model, lowering: &mut Lowering<'_>) -> LoweredEvents {
    let mut sharp = |tree| lowering.tree(tree, Smoothing::Sharp);
    let mut conditions: Vec<Id> = model.events.iter().map(|e| sharp(&e.when.tree)).collect();
    let mut resets = Vec::new();
    for event in &model.events {
        let set: Vec<(usize, Id)> =
            event.set.iter().map(|(state, value)| (*state, sharp(&value.tree))).collect();
        resets.push(set);
    }
    let mut rest_ends = Vec::new();
    for event in &model.events {
        let until = event.rest.as_ref().and_then(|rest| rest.until.as_ref());
        rest_ends.push(until.map(|until| {
            conditions.push(lowering.condition(&until.tree));
            conditions.len() - 1
        }));
    }
    (conditions, resets, rest_ends)
}

/// Differentiates the values `ids` with respect to all states and active parameters, and to time if `with_time`.
fn gradient(
    derivatives: &mut Derivatives,
    graph: &mut Graph,
    ids: &[Id],
    with_time: bool,
) -> ResultsWithGradient {
    let mut entries = Vec::new();
    for (row, id) in ids.iter().enumerate() {
        for (variable, derivative) in derivatives.all_derivatives(graph, *id) {
            let is_nonzero = graph.value_of(derivative) != Some(0.0);
            if is_nonzero && (with_time || variable != Variable::Time) {
                entries.push((row, variable, derivative));
            }
        }
    }
    (ids.to_vec(), entries)
}

impl Gradient {
    fn new(
        section: Section,
        results: &ResultsWithGradient,
        graph: &Graph,
        layout: &Layout,
        active: &[usize],
    ) -> Gradient {
        let column = |variable: &Variable| match variable {
            Variable::State(state) => Column::State(*state),
            Variable::Parameter(p) => Column::Active(active.iter().position(|a| a == p).unwrap_or(0)),
            Variable::Time => Column::Time,
        };
        let entries = results.1.iter().map(|(row, variable, id)| Entry {
            row: *row,
            column: column(variable),
            is_one: graph.value_of(*id) == Some(1.0),
            register: layout.register(*id) as usize,
        });
        Gradient { entries: entries.collect(), section }
    }
}

/// Checks that no event's reset leaves its own condition at 0 and moving on, which would fire it forever.
///
/// This is decided at a few sample points where `when` is 0: an event is refused if its condition moves on at
/// all of them (at least two).
fn check_events(
    model: &Model,
    graph: &Graph,
    rates: &[Id],
    conditions: &[Id],
    resets: &[Vec<(usize, Id)>],
) -> Result<(), ModelError> {
    let mut probe = Probe::new(model);
    for ((event, set), when) in model.events.iter().zip(resets).zip(conditions) {
        let points = probe.find_zeros(graph, *when);
        let mut changed_states = Vec::new();
        let mut tested_points = 0;
        let mut stuck_points = 0;
        for mut point in points {
            // Speed of `when` along the rates, by a central difference.
            let speed = |point: &crate::compile::Point| {
                let rates = probe.values(graph, point, rates);
                let moved = |h: f64| {
                    let mut moved = point.clone();
                    moved.states().iter_mut().zip(&rates).for_each(|(x, f)| *x += h * f);
                    probe.values(graph, &moved, &[*when])[0]
                };
                moved(1e-6) - moved(-1e-6)
            };
            let would_fire = |speed: f64| match event.direction {
                Direction::Rising => speed > 0.0,
                Direction::Falling => speed < 0.0,
                Direction::Both => speed != 0.0,
            };
            let speed_before = speed(&point);
            if !would_fire(speed_before) {
                continue;
            }
            let ids: Vec<Id> = set.iter().map(|(_, id)| *id).collect();
            let values = probe.values(graph, &point, &ids);
            let before_reset = point.clone();
            for ((state, _), value) in set.iter().zip(values) {
                if let Some(x) = point.states().get_mut(*state) {
                    // Collect the states that are set and that `when` depends on.
                    let mut nudged = before_reset.clone();
                    nudged.states()[*state] += 0.1;
                    let differs = probe.values(graph, &nudged, &[*when])
                        != probe.values(graph, &before_reset, &[*when]);
                    if differs && !changed_states.contains(state) {
                        changed_states.push(*state);
                    }
                    *x = value;
                }
            }
            let after = probe.values(graph, &point, &[*when])[0];
            tested_points += 1;
            let speed_after = speed(&point);
            stuck_points += usize::from(
                after.abs() < 1e-9 && would_fire(speed_after) && speed_after * speed_before > 0.0,
            );
        }
        if let Some(state) =
            changed_states.first().filter(|_| tested_points > 1 && stuck_points == tested_points)
        {
            let place =
                Place { file: model.file.clone(), line: event.line, key: format!("events.{}", event.name) };
            let fault = Fault::FiresForever { state: model.states[*state].name.clone() };
            return Err(ModelError { place, fault: Box::new(fault), excerpt: None });
        }
    }
    Ok(())
}
