//! Sizes of the quantities of a model in its data, from which the numbers of candidates follow.

use super::expand::Candidate;
use super::size::meant;
use crate::engine::{Options, Window};
use crate::model::{How, Model, Target};
use crate::system::System;
use crate::text::{Meaning, Symbol, Tree};

/// An amount is of usual size where its term has this share of the root mean square of what it changes.
const USUAL_SHARE: f64 = 0.05;
/// Bound of an amount whose row has none, in its usual size: five thousand times what would be noticed.
const MOST_USUAL: f64 = 1e5;
/// Points that sizes are taken over, at most.
const POINTS: usize = 2000;

/// States, inputs and times that occur.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scales {
    points: Vec<Point>,
    parameters: Vec<f64>,
    /// Seconds between samples: the median of the records.
    pub step_s: f64,
    /// Seconds that the longest record lasts.
    pub duration_s: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct Point {
    state: Vec<f64>,
    inputs: Vec<f64>,
    time: f64,
}

impl Scales {
    /// Sizes in a simulation of windows. Windows that cannot be simulated are left out.
    pub fn of(system: &System, windows: &[Window<'_>], options: &Options) -> Scales {
        let mut scales = Scales { step_s: 1.0, duration_s: 1.0, ..Scales::default() };
        let total: usize = windows.iter().map(|w| w.last + 1 - w.first).sum();
        let stride = total.div_ceil(POINTS).max(1);
        let mut count = 0;
        for window in windows {
            let Ok(states) = system.states_along(window, options) else { continue };
            for (k, state) in states.chunks_exact(window.start.len().max(1)).enumerate() {
                count += 1;
                let finite = state.iter().all(|x| x.is_finite());
                if count % stride == 0 && finite {
                    let time = window.record.times()[window.first + k];
                    let inputs = window.record.inputs().iter().map(|signal| signal.at(time)).collect();
                    scales.points.push(Point { state: state.to_vec(), inputs, time });
                }
            }
        }
        let mut steps: Vec<f64> = windows
            .iter()
            .flat_map(|w| w.record.times().windows(2).take(1000).map(|p| p[1] - p[0]))
            .collect();
        steps.sort_by(f64::total_cmp);
        scales.step_s = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        let lasts =
            |w: &Window<'_>| w.record.times().last().zip(w.record.times().first()).map(|(b, a)| b - a);
        scales.duration_s = windows.iter().filter_map(lasts).fold(scales.step_s, f64::max);
        scales.parameters = windows.first().map_or_else(Vec::new, |w| w.parameters.to_vec());
        scales
    }

    /// Values of an expression while a state or an input takes the values `x`; everything else stays as at the first point.
    pub(crate) fn swept(&self, model: &Model, tree: &Tree, of: Symbol, x: &[f64]) -> Option<Vec<f64>> {
        let first = self.points.first()?;
        let parameters: Vec<f64> = model.parameters.iter().map(|p| p.nominal).collect();
        let at = |x: &f64| {
            let mut point = first.clone();
            match of {
                Symbol::State(i) => *point.state.get_mut(i)? = *x,
                Symbol::Input(i) => *point.inputs.get_mut(i)? = *x,
                _ => return None,
            }
            Some(tree.value(&Scene::new(model, &point, &parameters, 1.0)))
        };
        x.iter().map(at).collect()
    }

    /// Smallest and largest value of a text in the names of the model; nothing where it has no two values.
    pub fn range(&self, text: &str, model: &Model) -> Option<[f64; 2]> {
        let values = self.values(text, model);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (low < high).then_some([low, high])
    }

    /// Values that a share `low` and a share `high` of the points do not exceed; nothing for a text without values.
    pub fn quantiles(&self, text: &str, model: &Model, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
        let mut values: Vec<f64> = self.values(text, model).into_iter().filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        Some([low, high].map(|share| values[(share * last as f64).round() as usize]))
    }

    /// Size of a term that has the usual share of a state's rate; nothing where that does not move.
    pub fn usual_of_rate(&self, state: usize, model: &Model) -> Option<f64> {
        let tree = &model.states.get(state)?.rate.tree;
        let rates: Vec<f64> =
            self.points.iter().map(|p| tree.value(&Scene::new(model, p, &self.parameters, 1.0))).collect();
        Some(USUAL_SHARE * rms(&rates)).filter(|size| *size > 0.0 && size.is_finite())
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Turns the numbers of a candidate into its units: multiples of sizes become values, and amounts get a usual size and
    /// bounds.
    pub fn resolve(&self, candidate: &mut Candidate, model: &Model) {
        let names = candidate.names.clone();
        for p in &mut candidate.parameters {
            let Some(of) = p.of.take() else { continue };
            let (offset, factor) = self.size(&of, &names, model);
            let value = |x: f64| if x.is_finite() { offset + factor * x } else { x };
            (p.min, p.max, p.null) = (value(p.min), value(p.max), value(p.null));
            p.typical = p.typical.map(value);
            p.grid.iter_mut().chain(&mut p.scan).for_each(|x| *x = value(*x));
        }
        for index in 0..candidate.parameters.len() {
            let p = &candidate.parameters[index];
            if p.is_inner {
                let p = &mut candidate.parameters[index];
                p.typical = p.typical.or(Some(p.null));
                continue;
            }
            let typical = p.typical.unwrap_or_else(|| self.usual(candidate, index, model));
            let p = &mut candidate.parameters[index];
            p.typical = Some(typical);
            let bound = MOST_USUAL * typical.abs();
            if p.min == f64::NEG_INFINITY {
                p.min = p.null - bound;
            }
            if p.max == f64::INFINITY {
                p.max = p.null + bound;
            }
        }
    }

    /// Offset and factor of what a parameter is measured in.
    fn size(&self, of: &str, names: &[(&'static str, String)], model: &Model) -> (f64, f64) {
        let inner = |prefix: &str| of.strip_prefix(prefix).and_then(|r| r.strip_suffix(')'));
        let values = |name: &str| self.values(&meant(name, names), model);
        let positive = |x: f64| if x > 0.0 && x.is_finite() { x } else { 1.0 };
        let ends = |v: &[f64]| {
            let low = v.iter().copied().fold(f64::INFINITY, f64::min);
            let high = v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if low < high { (low, high) } else { (0.0, 1.0) }
        };
        if let Some(name) = inner("range(") {
            let (low, high) = ends(&values(name));
            return (low, high - low);
        }
        if let Some(name) = inner("span(") {
            let (low, high) = ends(&values(name));
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
            _ => match of.strip_prefix("1/") {
                Some(name) => 1.0 / positive(rms(&values(name))),
                None => rms(&values(of)),
            },
        };
        (0.0, positive(size))
    }

    /// Size of an amount at which its term has the usual share of what it changes.
    fn usual(&self, candidate: &Candidate, index: usize, model: &Model) -> f64 {
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
        // A state that an effect brings along is taken as large as its first inner parameter.
        let brought = candidate.parameters.iter().find(|p| p.is_inner).map_or(1.0, |p| p.null);
        let Some(change) = scratch.additions.last().and_then(|a| a.changes.first()) else { return 1.0 };
        let (mut term, mut whole) = (Vec::new(), Vec::new());
        for point in &self.points {
            let scene = Scene::new(&scratch, point, &parameters, brought);
            let value = change.value.tree.value(&scene);
            term.push(if change.how == How::Factor { value - 1.0 } else { value });
            whole.push(match (change.how, change.target) {
                (How::Factor, _) => 1.0,
                (_, Target::Rate(i)) => scratch.states[i].rate.tree.value(&scene),
                (_, Target::Output(i)) => scratch.outputs[i].value.tree.value(&scene),
                (_, Target::Input(i)) => point.inputs.get(i).copied().unwrap_or(0.0),
                (_, Target::Parameter(i)) => parameters[i],
                (_, Target::Delay(_)) => self.step_s,
            });
        }
        let size = USUAL_SHARE * rms(&whole) / rms(&term);
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// Values of a text at all points.
    fn values(&self, text: &str, model: &Model) -> Vec<f64> {
        let Some(tree) = model.tree_of(text) else { return Vec::new() };
        let at = |point| tree.value(&Scene::new(model, point, &self.parameters, 1.0));
        self.points.iter().map(at).collect()
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Values at a point.
struct Scene<'s> {
    model: &'s Model,
    point: &'s Point,
    parameters: &'s [f64],
    brought: f64,
    lets: Vec<f64>,
}

impl<'s> Scene<'s> {
    fn new(model: &'s Model, point: &'s Point, parameters: &'s [f64], brought: f64) -> Self {
        let mut scene = Scene { model, point, parameters, brought, lets: Vec::new() };
        for declared in &model.lets {
            let value = declared.value.tree.value(&scene);
            scene.lets.push(value);
        }
        scene
    }
}

impl Meaning for Scene<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::State(i) => self.point.state.get(i).copied().unwrap_or(self.brought),
            Symbol::Input(i) => self.point.inputs.get(i).copied().unwrap_or(0.0),
            Symbol::Parameter(i) => self.parameters.get(i).copied().unwrap_or(0.0),
            Symbol::Let(i) => self.lets.get(i).copied().unwrap_or(0.0),
            Symbol::Time => self.point.time,
            Symbol::Output(i) => self.model.outputs.get(i).map_or(0.0, |o| o.value.tree.value(self)),
        }
    }

    fn table(&self, table: usize, at: f64) -> f64 {
        self.model.tables.get(table).map_or(0.0, |t| t.value(at))
    }

    /// Change per second of an output, by a small step to each side along the rates.
    fn slope(&self, output: usize) -> f64 {
        let declared = self.model.states.iter().take(self.point.state.len());
        let rates: Vec<f64> = declared.map(|s| s.rate.tree.value(self)).collect();
        let moved = |by: f64| {
            let state = self.point.state.iter().zip(&rates).map(|(x, f)| x + by * f).collect();
            let point = Point { state, ..self.point.clone() };
            let scene = Scene::new(self.model, &point, self.parameters, self.brought);
            self.model.outputs.get(output).map_or(0.0, |o| o.value.tree.value(&scene))
        };
        (moved(1e-6) - moved(-1e-6)) / 2e-6
    }
}
