//! Sizes (scales) of the quantities of a model in simulations of its data.
//!
//! The effect library gives many numbers as multiples of such sizes; here they are converted to units.

use super::expand::{Candidate, CandidateParameter};
use super::size::resolve_name;
use crate::engine::{Options, Window};
use crate::model::{Cycle, Force, How, Model, Target};
use crate::system::System;
use crate::text::{Bindings, Symbol, Tree};
use std::f64::consts::SQRT_2;

/// Typical size of an effect's term, as a share of the RMS of what the term changes.
const TYPICAL_RATIO: f64 = 0.05;
/// Bound of a coefficient whose library row gives none, as a multiple of the coefficient's typical value.
///
/// The bound is 5000 times what would be noticed.
const DEFAULT_BOUND_RATIO: f64 = 1e5;
/// Maximum number of points sampled from the simulations.
const MAX_POINTS: usize = 2000;
/// Maximum number of periods or frequencies of a periodic effect, half a cycle apart.
const MAX_HALF_CYCLES: u32 = 2000;

/// States, inputs and times that occur in simulations of the data, and the sampling of the records.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scales {
    points: Vec<Point>,
    parameters: Vec<f64>,
    /// Median time between samples over the records, s.
    pub step_s: f64,
    /// Duration of the longest record, s.
    pub duration_s: f64,
    /// For each generalised force of the external function, the size that has the effect of all others together.
    force_sizes: Vec<f64>,
}

/// States, inputs and time at one sample.
#[derive(Debug, Clone, PartialEq)]
struct Point {
    state: Vec<f64>,
    inputs: Vec<f64>,
    time: f64,
    /// Rates by the external function; empty if the model has none.
    external: Vec<f64>,
}

impl Scales {
    /// Samples states, inputs and times of simulated windows; windows that cannot be simulated are left out.
    pub fn sample(system: &System, windows: &[Window<'_>], options: &Options) -> Scales {
        let mut scales = Scales { step_s: 1.0, duration_s: 1.0, ..Scales::default() };
        let total: usize = windows.iter().map(|w| w.last + 1 - w.first).sum();
        let stride = total.div_ceil(MAX_POINTS).max(1);
        let mut count = 0;
        for window in windows {
            let Ok(states) = system.states_along(window, options) else { continue };
            let width = window.start.len();
            for k in 0..=window.last - window.first {
                let Some(state) = states.get(k * width..(k + 1) * width) else { break };
                count += 1;
                let finite = state.iter().all(|x| x.is_finite());
                if count % stride == 0 && finite {
                    let time = window.record.times()[window.first + k];
                    let inputs = window.record.inputs().iter().map(|signal| signal.at(time)).collect();
                    scales.points.push(Point { state: state.to_vec(), inputs, time, external: Vec::new() });
                }
            }
        }
        let mut steps: Vec<f64> = windows
            .iter()
            .flat_map(|w| w.record.times().windows(2).take(1000).map(|p| p[1] - p[0]))
            .collect();
        steps.sort_by(f64::total_cmp);
        scales.step_s = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        let duration =
            |w: &Window<'_>| w.record.times().last().zip(w.record.times().first()).map(|(b, a)| b - a);
        scales.duration_s = windows.iter().filter_map(duration).fold(scales.step_s, f64::max);
        scales.parameters = windows.first().map_or_else(Vec::new, |w| w.parameters.to_vec());
        scales.evaluate_external_rates(system.model());
        scales
    }

    /// Computes the rates of the external function of a model at all points, and the sizes of its forces.
    fn evaluate_external_rates(&mut self, model: &Model) {
        let Some(external) = &model.external else { return };
        let Some(function) = external.rates.as_ref().filter(|_| !self.points.is_empty()) else { return };
        let (points, states) = (self.points.len(), model.declared_states());
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(points);
        for point in &self.points {
            let mut row = vec![point.time];
            row.extend(point.state.iter().take(states).chain(point.inputs.iter().take(external.inputs)));
            row.extend(model.external_parameters().map(|p| self.parameters.get(p).copied().unwrap_or(0.0)));
            row.extend(external.forces.iter().map(|_| 0.0));
            rows.push(row);
        }
        let count = rows.first().map_or(0, Vec::len);
        let arguments: Vec<f64> = (0..count).flat_map(|k| rows.iter().map(move |row| row[k])).collect();
        let wanted: Vec<usize> = (count - external.forces.len().min(count)..count).collect();
        let found = function.evaluate(points, &arguments, &wanted);
        for (index, point) in self.points.iter_mut().enumerate() {
            point.external = (0..states).map(|state| found.rates[state * points + index]).collect();
        }
        let force_size = |(k, force): (usize, &Force)| {
            let by_force = &found.derivatives[(force.speed * wanted.len() + k) * points..][..points];
            rms(&found.rates[force.speed * points..][..points]) / rms(by_force)
        };
        self.force_sizes = external.forces.iter().enumerate().map(force_size).collect();
    }

    /// Computes an expression while one state or input takes the values `x`.
    ///
    /// All other quantities keep their values of the first sampled point.
    pub(crate) fn values_over(
        &self,
        model: &Model,
        tree: &Tree,
        variable: Symbol,
        x: &[f64],
    ) -> Option<Vec<f64>> {
        let first = self.points.first()?;
        let parameters: Vec<f64> = model.parameters.iter().map(|p| p.nominal).collect();
        let at = |x: &f64| {
            let mut point = first.clone();
            match variable {
                Symbol::State(i) => *point.state.get_mut(i)? = *x,
                Symbol::Input(i) => *point.inputs.get_mut(i)? = *x,
                _ => return None,
            }
            Some(tree.value(&PointValues::new(model, &point, &parameters, 1.0)))
        };
        x.iter().map(at).collect()
    }

    /// Smallest and largest value of an expression over the sampled points; `None` if it does not vary.
    pub fn range(&self, text: &str, model: &Model) -> Option<[f64; 2]> {
        let values = self.values(text, model);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (low < high).then_some([low, high])
    }

    /// Quantiles `low` and `high` (shares from 0 to 1) of an expression over the sampled points; `None` without values.
    pub fn quantiles(&self, text: &str, model: &Model, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
        let mut values: Vec<f64> = self.values(text, model).into_iter().filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        Some([low, high].map(|share| values[(share * last as f64).round() as usize]))
    }

    /// Typical size of a term added to the rate of a state; `None` if the rate is always 0.
    pub fn typical_rate_change(&self, state: usize, model: &Model) -> Option<f64> {
        let tree = &model.states.get(state)?.rate.tree;
        let rates: Vec<f64> = self
            .points
            .iter()
            .map(|p| tree.value(&PointValues::new(model, p, &self.parameters, 1.0)))
            .collect();
        Some(TYPICAL_RATIO * rms(&rates)).filter(|size| *size > 0.0 && size.is_finite())
    }

    /// Whether no points were sampled.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Converts the numbers of a candidate effect to the units of its parameters.
    ///
    /// Multiples of sizes become values. A coefficient gets a typical value, and bounds where its library row
    /// gives none.
    pub fn resolve(&self, candidate: &mut Candidate, model: &Model) {
        let (names, copies) = (candidate.names.clone(), candidate.copies.max(1));
        let part_names = candidate.part_names.clone();
        for (index, p) in candidate.parameters.iter_mut().enumerate() {
            let Some(of) = p.of.take() else { continue };
            let names = part_names.get(index % copies).unwrap_or(&names);
            let (offset, factor) = self.size(&of, names, model);
            let value = |x: f64| if x.is_finite() { offset + factor * x } else { x };
            p.cycles = self.cycles(p).into_iter().map(value).collect();
            if p.cycle == Some(Cycle::Period) {
                let has_speed = names.iter().any(|(name, _)| *name == "v");
                p.cycle_speed = if has_speed { self.size("peak(v)", names, model).1 } else { 0.0 };
            }
            (p.min, p.max, p.null) = (value(p.min), value(p.max), value(p.null));
            p.typical = p.typical.map(value);
            p.grid.iter_mut().chain(&mut p.scan).for_each(|x| *x = value(*x));
            if let Some(least) = p.least.take() {
                raise(p, self.size(&least, names, model).1);
            }
        }
        let inner = candidate.parameters.iter().find(|p| p.is_inner).map_or(1.0, |p| p.null.abs());
        for state in &mut candidate.states {
            let of_start = || self.spread(&state.start, model);
            let spread = match &state.spread {
                Some(of) => Some(rms(&self.values(of, model))),
                None => of_start(),
            };
            state.sd = Some(spread.filter(|sd| *sd > 0.0 && sd.is_finite()).unwrap_or(inner));
        }
        for index in 0..candidate.parameters.len() {
            let p = &candidate.parameters[index];
            if p.is_inner {
                let p = &mut candidate.parameters[index];
                p.typical = p.typical.or(Some(p.null));
                continue;
            }
            let typical = p.typical.unwrap_or_else(|| self.typical_value(candidate, index, model));
            let p = &mut candidate.parameters[index];
            p.typical = Some(typical);
            let bound = DEFAULT_BOUND_RATIO * typical.abs();
            if p.min == f64::NEG_INFINITY {
                p.min = p.null - bound;
            }
            if p.max == f64::INFINITY {
                p.max = p.null + bound;
            }
        }
    }

    /// Periods or frequencies of a periodic effect, as multiples of its size: half a cycle apart over that size.
    ///
    /// Frequencies in time end at half the sampling rate.
    fn cycles(&self, p: &CandidateParameter) -> Vec<f64> {
        let counts = (1..=MAX_HALF_CYCLES).map(|k| 0.5 * f64::from(k));
        let values: Vec<f64> = match p.cycle {
            None => return Vec::new(),
            Some(Cycle::Period) => counts.map(|cycles| 1.0 / cycles).collect(),
            Some(Cycle::Frequency) => {
                let highest = 0.5 * self.duration_s / self.step_s;
                counts.take_while(|cycles| *cycles <= highest).collect()
            }
        };
        values.into_iter().filter(|x| (p.min..=p.max).contains(x)).collect()
    }

    /// Offset and factor that convert numbers of a library row, which are multiples of the size `of`, to values.
    fn size(&self, of: &str, names: &[(&'static str, String)], model: &Model) -> (f64, f64) {
        let inner = |prefix: &str| of.strip_prefix(prefix).and_then(|r| r.strip_suffix(')'));
        let values = |name: &str| self.values(&resolve_name(name, names), model);
        let positive = |x: f64| if x > 0.0 && x.is_finite() { x } else { 1.0 };
        let limits = |v: &[f64]| {
            let low = v.iter().copied().fold(f64::INFINITY, f64::min);
            let high = v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if low < high { (low, high) } else { (0.0, 1.0) }
        };
        if let Some(name) = inner("range(") {
            let (low, high) = limits(&values(name));
            return (low, high - low);
        }
        if let Some(name) = inner("span(") {
            let (low, high) = limits(&values(name));
            return (0.0, high - low);
        }
        if let Some(name) = inner("peak(") {
            return (0.0, positive(values(name).iter().fold(0.0, |most: f64, x| most.max(x.abs()))));
        }
        let size = match of {
            "1" => 1.0,
            "step" => self.step_s,
            "1/step" => 1.0 / self.step_s,
            "duration" => self.duration_s,
            "turn" => 2.0 * std::f64::consts::PI / self.duration_s,
            "rate" => rms(&values("v")) / positive(rms(&values("x"))),
            // An oscillation of amplitude A and angular frequency w passes A (w step)^2 / 2 in the step after a reversal.
            "reversal" => (rms(&values("v")) * self.step_s).powi(2) / (SQRT_2 * positive(rms(&values("x")))),
            _ => match of.strip_prefix("1/") {
                Some(name) => 1.0 / positive(rms(&values(name))),
                None => rms(&values(of)),
            },
        };
        (0.0, positive(size))
    }

    /// Value of a coefficient at which its term has the typical size of an effect.
    fn typical_value(&self, candidate: &Candidate, index: usize, model: &Model) -> f64 {
        let mut values = candidate.nulls();
        values[index] = 1.0;
        let mut scratch = Model { text: String::new(), ..model.clone() };
        if self.points.is_empty() || scratch.add(&candidate.draft(&values)).is_err() {
            return 1.0;
        }
        let first = scratch.declared_parameters().min(model.parameters.len());
        let mut parameters = self.parameters.clone();
        parameters.resize(model.parameters.len().max(first), 0.0);
        parameters.extend(&values);
        // A state that belongs to the effect is taken to be as large as its first inner parameter.
        let effect_state = candidate.parameters.iter().find(|p| p.is_inner).map_or(1.0, |p| p.null);
        // Of an effect on all joints, the change of the parameter's own joint.
        let part = if candidate.part_names.is_empty() { 0 } else { index % candidate.copies };
        let Some(change) = scratch.additions.last().and_then(|a| a.changes.get(part)) else { return 1.0 };
        let (mut term, mut changed) = (Vec::new(), Vec::new());
        for point in &self.points {
            let point_values = PointValues::new(&scratch, point, &parameters, effect_state);
            let term_value = change.value.tree.value(&point_values);
            term.push(if change.how == How::Factor { term_value - 1.0 } else { term_value });
            changed.push(match (change.how, change.target) {
                (How::Factor, _) => 1.0,
                (_, Target::Rate(i)) => scratch.states[i].rate.tree.value(&point_values),
                (_, Target::Output(i)) => scratch.outputs[i].value.tree.value(&point_values),
                (_, Target::Input(i)) => point.inputs.get(i).copied().unwrap_or(0.0),
                (_, Target::Parameter(i)) => parameters[i],
                (_, Target::Delay(_)) => self.step_s,
                (_, Target::Joint(joint)) => scratch.joint_torque(joint, &point_values),
                (_, Target::Force(k)) => self.force_sizes.get(k).copied().unwrap_or(1.0),
                (_, target) => scratch.robot.as_ref().map_or(1.0, |robot| robot.typical_property(target)),
            });
        }
        let size = TYPICAL_RATIO * rms(&changed) / rms(&term);
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// Standard deviation of an expression over the sampled points; 0 for a number.
    fn spread(&self, text: &str, model: &Model) -> Option<f64> {
        let values = self.values(text, model);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let deviations: Vec<f64> = values.iter().map(|x| x - mean).collect();
        (!values.is_empty()).then(|| rms(&deviations))
    }

    /// Computes an expression at all sampled points.
    fn values(&self, text: &str, model: &Model) -> Vec<f64> {
        let Some(tree) = model.tree_of(text) else { return Vec::new() };
        let at = |point| tree.value(&PointValues::new(model, point, &self.parameters, 1.0));
        self.points.iter().map(at).collect()
    }
}

/// Raises the bounds and starting values of an inner parameter to at least `least`.
fn raise(p: &mut CandidateParameter, least: f64) {
    let least = p.min.max(least.min(p.max));
    (p.min, p.null) = (least, p.null.max(least));
    p.grid.iter_mut().for_each(|x| *x = x.max(least));
    p.grid.dedup();
}

/// Root mean square of values; 0 for an empty list.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Values of all quantities that an expression may use, at a sampled point.
struct PointValues<'s> {
    model: &'s Model,
    point: &'s Point,
    parameters: &'s [f64],
    /// Value of the states that belong to effects, which are not in the point.
    effect_state: f64,
    lets: Vec<f64>,
}

impl<'s> PointValues<'s> {
    fn new(model: &'s Model, point: &'s Point, parameters: &'s [f64], effect_state: f64) -> Self {
        let mut values = PointValues { model, point, parameters, effect_state, lets: Vec::new() };
        for declared in &model.lets {
            let value = declared.value.tree.value(&values);
            values.lets.push(value);
        }
        values
    }
}

impl Bindings for PointValues<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::State(i) => self.point.state.get(i).copied().unwrap_or(self.effect_state),
            Symbol::Input(i) => self.point.inputs.get(i).copied().unwrap_or(0.0),
            Symbol::Parameter(i) => self.parameters.get(i).copied().unwrap_or(0.0),
            Symbol::Let(i) => self.lets.get(i).copied().unwrap_or(0.0),
            Symbol::Time => self.point.time,
            Symbol::JointTorque(_) | Symbol::JointAcceleration(_) => {
                self.model.robot.as_ref().map_or(0.0, |robot| robot.value(symbol, self))
            }
            Symbol::ExternalRate(i) => self.point.external.get(i).copied().unwrap_or(0.0),
            Symbol::Output(i) => self.model.outputs.get(i).map_or(0.0, |o| o.value.tree.value(self)),
        }
    }

    fn table(&self, table: usize, at: f64) -> f64 {
        self.model.tables.get(table).map_or(0.0, |t| t.value(at))
    }

    /// Change per second of an output: a central difference along the rates of the states.
    fn slope(&self, output: usize) -> f64 {
        let declared = self.model.states.iter().take(self.point.state.len());
        let rates: Vec<f64> = declared.map(|s| s.rate.tree.value(self)).collect();
        let moved = |by: f64| {
            let state = self.point.state.iter().zip(&rates).map(|(x, f)| x + by * f).collect();
            let point = Point { state, ..self.point.clone() };
            let values = PointValues::new(self.model, &point, self.parameters, self.effect_state);
            self.model.outputs.get(output).map_or(0.0, |o| o.value.tree.value(&values))
        };
        (moved(1e-6) - moved(-1e-6)) / 2e-6
    }
}
