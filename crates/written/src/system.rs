//! A model compiled: programs for its rates, outputs, events and resets with their derivatives.

use crate::compile::{Derivatives, Graph, Id, Layout, Lowering, Probe, Section, Smoothing, Variable, Width};
use crate::error::{Fault, ModelError, Place};
use crate::machine::Machine;
use crate::model::{Direction, Model};
use pulp::Arch;
use std::collections::BTreeMap;

/// A compiled system: simulates windows with derivatives with respect to states and a choice of parameters.
#[derive(Debug, Clone)]
pub struct System {
    pub(crate) model: Model,
    pub(crate) active: Vec<usize>,
    pub(crate) machine: Machine,
    pub(crate) layout: Layout,
    /// Program of the values that depend on parameters alone.
    pub(crate) once: Section,
    pub(crate) rates: Section,
    pub(crate) rate_gradient: Gradient,
    pub(crate) outputs: Section,
    pub(crate) output_gradient: Gradient,
    /// Values of all `when`, then of all `until` (positive where they hold).
    pub(crate) conditions: Section,
    pub(crate) condition_gradients: Vec<Gradient>,
    pub(crate) resets: Vec<Gradient>,
    /// Condition that ends the rest of each event: index into `conditions`.
    pub(crate) untils: Vec<Option<usize>>,
    /// Arguments of smoothed jumps, to find their width.
    pub(crate) jumps: Section,
    /// Widths of smoothed jumps.
    pub(crate) widths: Vec<f64>,
    /// Texts of their arguments.
    pub(crate) width_texts: Vec<String>,
    /// Which widths the file declares.
    pub(crate) declared_widths: Vec<bool>,
}

/// Values and their derivatives that are not 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Gradient {
    /// Results: the values, then the derivative of each entry.
    pub(crate) section: Section,
    pub(crate) entries: Vec<Entry>,
}

/// A derivative: of value number `row`, with respect to `column`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) row: usize,
    pub(crate) column: Column,
    /// It is 1 always.
    pub(crate) is_one: bool,
    /// Register.
    pub(crate) register: usize,
}

/// The number that a derivative is with respect to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Column {
    State(usize),
    /// Index into the active parameters.
    Active(usize),
    Time,
}

/// Width of a smoothed jump until it is declared or found from a simulation, in the unit of its argument.
const DEFAULT_WIDTH: f64 = 0.01;

/// Results of a program: values, and entries of their gradients.
type Wanted = (Vec<Id>, Vec<(usize, Variable, Id)>);

impl System {
    /// Compiles a model, with derivatives with respect to the parameters `active` (indices into those of the model).
    ///
    /// # Errors
    /// [`Fault::TooLarge`] if it needs more operations than are allowed, [`Fault::FiresForEver`] for an event that
    /// does not end its own condition.
    pub fn compile(model: &Model, active: &[usize]) -> Result<System, ModelError> {
        let mut lowering = Lowering::new(model);
        let (rates, outputs) = (lowering.rates(), lowering.outputs());
        let mut sharp = |tree| lowering.tree(tree, Smoothing::Sharp);
        let mut conditions: Vec<Id> = model.events.iter().map(|e| sharp(&e.when.tree)).collect();
        let mut resets = Vec::new();
        let mut untils = Vec::new();
        for event in &model.events {
            let set: Vec<(usize, Id)> =
                event.set.iter().map(|(state, value)| (*state, sharp(&value.tree))).collect();
            resets.push(set);
        }
        for event in &model.events {
            let until = event.rest.as_ref().and_then(|rest| rest.until.as_ref());
            untils.push(until.map(|until| {
                conditions.push(lowering.condition(&until.tree));
                conditions.len() - 1
            }));
        }
        let Lowering { mut graph, widths, .. } = lowering;
        check_events(model, &graph, &rates, &conditions, &resets)?;
        let delays = model.inputs.iter().map(|i| i.delay).collect();
        let mut derivatives = Derivatives::new(active, delays);
        let mut of = |graph: &mut Graph, ids: &[Id], with_time: bool| {
            gradient(&mut derivatives, graph, ids, with_time)
        };
        let rate_wanted = of(&mut graph, &rates, false);
        let output_wanted = of(&mut graph, &outputs, false);
        let conditions_wanted: Vec<Wanted> =
            conditions.iter().map(|id| of(&mut graph, &[*id], true)).collect();
        let mut resets_wanted = Vec::new();
        for set in &resets {
            let mut values: Vec<Id> = Vec::new();
            for state in 0..model.states.len() {
                let assigned = set.iter().rev().find(|(s, _)| *s == state).map(|(_, id)| *id);
                values.push(assigned.unwrap_or_else(|| graph.leaf(crate::compile::Code::State, state)));
            }
            resets_wanted.push(of(&mut graph, &values, true));
        }
        if graph.is_too_large() {
            let place = Place { file: model.file.clone(), line: 1, key: String::new() };
            return Err(ModelError { place, fault: Box::new(Fault::TooLarge), excerpt: None });
        }
        let flat = |wanted: &Wanted| -> Vec<Id> {
            wanted.0.iter().copied().chain(wanted.1.iter().map(|(_, _, id)| *id)).collect()
        };
        let jumps: Vec<Id> = widths.iter().map(|w| w.argument).collect();
        let mut wanted = vec![rates, outputs, conditions, jumps, flat(&rate_wanted), flat(&output_wanted)];
        wanted.extend(conditions_wanted.iter().map(flat));
        wanted.extend(resets_wanted.iter().map(flat));
        let sizes = (model.states.len(), model.inputs.len(), model.parameters.len(), widths.len());
        let (layout, once, sections) = Layout::assign(sizes, &graph, &wanted);
        let mut sections = sections.into_iter();
        let mut next = || sections.next().unwrap_or_default();
        let [rates, outputs, conditions, jumps] = [next(), next(), next(), next()];
        let mut complete = |wanted: &Wanted| Gradient::new(next(), wanted, &graph, &layout, active);
        Ok(System {
            rate_gradient: complete(&rate_wanted),
            output_gradient: complete(&output_wanted),
            condition_gradients: conditions_wanted.iter().map(&mut complete).collect(),
            resets: resets_wanted.iter().map(&mut complete).collect(),
            model: model.clone(),
            active: active.to_vec(),
            machine: Machine { arch: Arch::new(), tables: model.tables.clone() },
            once,
            rates,
            outputs,
            conditions,
            untils,
            jumps,
            widths: widths.iter().map(|w| w.declared.unwrap_or(DEFAULT_WIDTH)).collect(),
            width_texts: widths.iter().map(|w| w.text.clone()).collect(),
            declared_widths: widths.iter().map(|w: &Width| w.declared.is_some()).collect(),
            layout,
        })
    }

    /// The model that it was compiled from.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Parameters with derivatives, as indices into those of the model.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// Operations of a right-hand side, and of one with its derivatives: for reports and benchmarks.
    pub fn operations(&self) -> (usize, usize) {
        (self.rates.body.len(), self.rate_gradient.section.body.len())
    }

    /// Widths of smoothed jumps, in the order in which they stand in the rates, in the unit of what jumps.
    pub fn widths(&self) -> &[f64] {
        &self.widths
    }

    /// Widths of smoothed jumps by the text of what jumps, as a model file names them.
    pub fn named_widths(&self) -> BTreeMap<String, f64> {
        self.width_texts.iter().cloned().zip(self.widths.iter().copied()).collect()
    }

    /// Takes the widths of smoothed jumps that it shares with another system: those that data gave.
    pub(crate) fn with_widths_of(mut self, other: &System) -> System {
        for (text, width) in self.width_texts.iter().zip(&mut self.widths) {
            if let Some(there) = other.width_texts.iter().position(|t| t == text) {
                *width = other.widths[there];
            }
        }
        self
    }

    pub(crate) fn states(&self) -> usize {
        self.model.states.len()
    }

    pub(crate) fn is_plain(&self) -> bool {
        let wall = |s: &crate::model::State| s.min.is_some() || s.max.is_some();
        self.model.events.is_empty() && !self.model.states.iter().any(wall)
    }
}

/// Derivatives of `ids` with respect to all variables (`with_time`: and time).
fn gradient(derivatives: &mut Derivatives, graph: &mut Graph, ids: &[Id], with_time: bool) -> Wanted {
    let mut entries = Vec::new();
    for (row, id) in ids.iter().enumerate() {
        for (variable, derivative) in derivatives.of(graph, *id) {
            let matters = graph.value_of(derivative) != Some(0.0);
            if matters && (with_time || variable != Variable::Time) {
                entries.push((row, variable, derivative));
            }
        }
    }
    (ids.to_vec(), entries)
}

impl Gradient {
    fn new(section: Section, wanted: &Wanted, graph: &Graph, layout: &Layout, active: &[usize]) -> Gradient {
        let column = |variable: &Variable| match variable {
            Variable::State(state) => Column::State(*state),
            Variable::Parameter(p) => Column::Active(active.iter().position(|a| a == p).unwrap_or(0)),
            Variable::Time => Column::Time,
        };
        let entries = wanted.1.iter().map(|(row, variable, id)| Entry {
            row: *row,
            column: column(variable),
            is_one: graph.value_of(*id) == Some(1.0),
            register: layout.register(*id) as usize,
        });
        Gradient { entries: entries.collect(), section }
    }
}

/// Refuses events that set a state of their own condition to where it still holds and still moves on.
fn check_events(
    model: &Model,
    graph: &Graph,
    rates: &[Id],
    conditions: &[Id],
    resets: &[Vec<(usize, Id)>],
) -> Result<(), ModelError> {
    let mut probe = Probe::new(model);
    for ((event, set), when) in model.events.iter().zip(resets).zip(conditions) {
        let points = probe.zeros(graph, *when);
        let mut of_when = Vec::new();
        let mut judged = 0;
        let mut stuck = 0;
        for mut point in points {
            // Speed of `when` along the rates, by a small step to each side.
            let speed = |point: &crate::compile::Point| {
                let rates = probe.values(graph, point, rates);
                let moved = |h: f64| {
                    let mut moved = point.clone();
                    moved.states().iter_mut().zip(&rates).for_each(|(x, f)| *x += h * f);
                    probe.values(graph, &moved, &[*when])[0]
                };
                moved(1e-6) - moved(-1e-6)
            };
            let fires = |speed: f64| match event.direction {
                Direction::Rising => speed > 0.0,
                Direction::Falling => speed < 0.0,
                Direction::Both => speed != 0.0,
            };
            let before = speed(&point);
            if !fires(before) {
                continue;
            }
            let ids: Vec<Id> = set.iter().map(|(_, id)| *id).collect();
            let values = probe.values(graph, &point, &ids);
            let old = point.clone();
            for ((state, _), value) in set.iter().zip(values) {
                if let Some(x) = point.states().get_mut(*state) {
                    // Which of the states that are set does `when` depend on?
                    let mut nudged = old.clone();
                    nudged.states()[*state] += 0.1;
                    let differs =
                        probe.values(graph, &nudged, &[*when]) != probe.values(graph, &old, &[*when]);
                    if differs && !of_when.contains(state) {
                        of_when.push(*state);
                    }
                    *x = value;
                }
            }
            let after = probe.values(graph, &point, &[*when])[0];
            judged += 1;
            let again = speed(&point);
            stuck += usize::from(after.abs() < 1e-9 && fires(again) && again * before > 0.0);
        }
        if let Some(state) = of_when.first().filter(|_| judged > 1 && stuck == judged) {
            let place =
                Place { file: model.file.clone(), line: event.line, key: format!("events.{}", event.name) };
            let fault = Fault::FiresForEver { state: model.states[*state].name.clone() };
            return Err(ModelError { place, fault: Box::new(fault), excerpt: None });
        }
    }
    Ok(())
}
