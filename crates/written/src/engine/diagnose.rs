//! Finds the operation of a rate that made it infinite or no number.

use super::{Options, SimulationError, Window};
use crate::model::{How, Model, Target};
use crate::system::System;
use crate::text::{Kind, Meaning, Symbol, Tree};

/// The failure of a window whose state number `state` is not finite at its sample `index`.
pub(crate) fn not_finite(
    system: &System,
    window: &Window<'_>,
    index: usize,
    state: usize,
    options: &Options,
) -> SimulationError {
    let sample = (window.first + index).min(window.last);
    let before = sample.saturating_sub(1).max(window.first);
    let name = |state: usize| system.model.states[state].name.clone();
    // The last sample that is finite, by simulating up to it again; the fault lies in its rates or one step behind.
    let shorter = Window { last: before, ..window.clone() };
    // A start that is not finite itself has no such sample, and asking for it would lead here again.
    let up_to = (index > 0).then(|| system.simulate(std::slice::from_ref(&shorter), &[], options).pop());
    let start = match up_to.flatten() {
        Some(Ok(simulated)) => simulated.end,
        _ => window.start.to_vec(),
    };
    let times = &window.record.times;
    let mut failure = SimulationError::NotFinite {
        record: window.record.name.clone(),
        time: times[sample],
        state: name(state),
        cause: None,
    };
    // Small explicit steps from there show the first rate that fails and the state in which it does.
    let steps = 1000 * options.substeps.max(1);
    let h = (times[sample] - times[before]) / steps as f64;
    let mut x = start;
    for step in 0..=steps {
        let time = times[before] + h * step as f64;
        let scene = Scene::new(&system.model, window, &x, time);
        let mut rates = Vec::with_capacity(x.len());
        for state in 0..x.len() {
            let rate = scene.rate(state);
            if !rate.is_finite() {
                if let SimulationError::NotFinite { time: at, state: of, cause, .. } = &mut failure {
                    (*at, *of) = (time, name(state));
                    *cause = scene.cause(state);
                }
                return failure;
            }
            rates.push(rate);
        }
        x.iter_mut().zip(&rates).for_each(|(x, rate)| *x += h * rate);
    }
    failure
}

/// Values of everything that a tree may name.
struct Scene<'s> {
    model: &'s Model,
    window: &'s Window<'s>,
    x: &'s [f64],
    time: f64,
    /// Values of `[let]`, as far as they are known.
    lets: Vec<f64>,
}

impl<'s> Scene<'s> {
    fn new(model: &'s Model, window: &'s Window<'s>, x: &'s [f64], time: f64) -> Self {
        let mut scene = Scene { model, window, x, time, lets: Vec::new() };
        for declared in &model.lets {
            let value = declared.value.tree.value(&scene);
            scene.lets.push(value);
        }
        scene
    }

    /// The rate of a state with everything that was added to it.
    fn rate(&self, state: usize) -> f64 {
        let declared = self.model.states[state].rate.tree.value(self);
        let changes = self.model.additions.iter().flat_map(|a| &a.changes);
        changes.filter(|c| c.target == Target::Rate(state)).fold(declared, |rate, change| {
            let value = change.value.tree.value(self);
            match change.how {
                How::Add => rate + value,
                How::Factor => rate * value,
                How::Replace => value,
            }
        })
    }

    /// The cause of a rate that is not finite: within the first `[let]` value that is not, or within its own expression.
    fn cause(&self, state: usize) -> Option<String> {
        let values = self.model.lets.iter().zip(&self.lets);
        let first = values.into_iter().find(|(_, value)| !value.is_finite());
        let own = std::iter::once(&self.model.states[state].rate.tree).chain(self.model.added_trees());
        let trees = first.map(|(declared, _)| &declared.value.tree).into_iter().chain(own);
        trees.into_iter().find_map(|tree| cause_in(tree, &tree.values(self)))
    }
}

impl Meaning for Scene<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::State(i) => self.x[i],
            Symbol::Input(i) => {
                let delay = self.model.inputs[i].delay.map_or(0.0, |d| self.window.parameters[d]);
                self.window.record.inputs[i].at(self.time - delay)
            }
            Symbol::Parameter(i) => self.window.parameters[i],
            Symbol::Let(i) => self.lets.get(i).copied().unwrap_or(0.0),
            Symbol::Time => self.time,
            Symbol::Output(_) => 0.0,
        }
    }

    fn table(&self, table: usize, at: f64) -> f64 {
        self.model.tables.get(table).map_or(0.0, |t| t.value(at))
    }

    fn slope(&self, _output: usize) -> f64 {
        0.0
    }
}

/// The first node that is not finite though what it is made of is, in words.
fn cause_in(tree: &Tree, values: &[f64]) -> Option<String> {
    let broken = |i: &usize| !values[*i].is_finite();
    for (index, node) in tree.nodes.iter().enumerate() {
        if !broken(&index) {
            continue;
        }
        let text = |i: usize| augsim_data::shown(without_brackets(tree.text_of(i)));
        return Some(match &node.kind {
            Kind::Divide(a, b) if !broken(a) && values[*b] == 0.0 => {
                format!("division by `{}` = 0", text(*b))
            }
            Kind::Call(function, arguments) if !arguments.iter().any(broken) => {
                let z = arguments.first().map_or(0.0, |a| values[*a]);
                let argument = arguments.first().map_or_else(String::new, |a| text(*a));
                format!("`{}` of `{argument}` = {z}", function.name())
            }
            Kind::Power(a, b) if !broken(a) && !broken(b) => {
                format!("`{}` = {} to the power of `{}` = {}", text(*a), values[*a], text(*b), values[*b])
            }
            Kind::Symbol(_) => continue,
            _ => format!("`{}` is {}", text(index), values[index]),
        });
    }
    None
}

/// A text without the pair of brackets around the whole of it.
fn without_brackets(text: &str) -> &str {
    let Some(inner) = text.strip_prefix('(').and_then(|t| t.strip_suffix(')')) else { return text };
    let mut depth = 0;
    for c in inner.chars() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if depth < 0 {
            return text;
        }
    }
    inner
}
