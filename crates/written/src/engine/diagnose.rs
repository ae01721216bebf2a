//! Finds the operation of a rate that made it infinite or no number.

use super::{Options, SimulationError, Window};
use crate::model::Model;
use crate::system::System;
use crate::text::{Kind, Symbol, Tree};

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
    let start = match system.simulate(std::slice::from_ref(&shorter), &[], options).pop() {
        Some(Ok(simulated)) if index > 0 => simulated.end,
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
        let scene = Scene { model: &system.model, window, x: &x, time };
        let lets = scene.lets();
        let mut rates = Vec::with_capacity(x.len());
        for (state, declared) in system.model.states.iter().enumerate() {
            let values = scene.values(&declared.rate.tree, &lets);
            let rate = values.last().copied().unwrap_or(0.0);
            if !rate.is_finite() {
                if let SimulationError::NotFinite { time: at, state: of, cause, .. } = &mut failure {
                    (*at, *of) = (time, name(state));
                    *cause = scene.cause(&lets).or_else(|| cause_in(&declared.rate.tree, &values));
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
}

impl Scene<'_> {
    fn lets(&self) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::new();
        for declared in &self.model.lets {
            let value = self.values(&declared.value.tree, &values).last().copied().unwrap_or(0.0);
            values.push(value);
        }
        values
    }

    /// The cause within the first `[let]` value that is not finite.
    fn cause(&self, lets: &[f64]) -> Option<String> {
        let first = lets.iter().position(|value| !value.is_finite())?;
        let tree = &self.model.lets[first].value.tree;
        cause_in(tree, &self.values(tree, lets))
    }

    /// Value of every node of a tree; jumps are sharp.
    fn values(&self, tree: &Tree, lets: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(tree.nodes.len());
        for node in &tree.nodes {
            let at = |i: &usize| values[*i];
            let value = match &node.kind {
                Kind::Number(value) => *value,
                Kind::Symbol(symbol) => self.symbol(*symbol, lets),
                Kind::Negate(a) => -at(a),
                Kind::Add(a, b) => at(a) + at(b),
                Kind::Subtract(a, b) => at(a) - at(b),
                Kind::Multiply(a, b) => at(a) * at(b),
                Kind::Divide(a, b) => at(a) / at(b),
                Kind::Power(a, b) => at(a).powf(at(b)),
                Kind::Call(function, arguments) => {
                    function.value(&arguments.iter().map(at).collect::<Vec<f64>>())
                }
                Kind::If { comparison, left, right, then, otherwise } => {
                    let (left, right) = (at(left), at(right));
                    at(if comparison.holds(left, right) { then } else { otherwise })
                }
                Kind::Table { table, at: z } => self.model.tables[*table].value(at(z)),
                Kind::Slope { .. } => 0.0,
            };
            values.push(value);
        }
        values
    }

    fn symbol(&self, symbol: Symbol, lets: &[f64]) -> f64 {
        match symbol {
            Symbol::State(i) => self.x[i],
            Symbol::Input(i) => {
                let delay = self.model.inputs[i].delay.map_or(0.0, |d| self.window.parameters[d]);
                self.window.record.inputs[i].at(self.time - delay)
            }
            Symbol::Parameter(i) => self.window.parameters[i],
            Symbol::Let(i) => lets.get(i).copied().unwrap_or(0.0),
            Symbol::Time => self.time,
            Symbol::Output(_) => 0.0,
        }
    }
}

/// The first node that is not finite though what it is made of is, in words.
fn cause_in(tree: &Tree, values: &[f64]) -> Option<String> {
    let broken = |i: &usize| !values[*i].is_finite();
    for (index, node) in tree.nodes.iter().enumerate() {
        if !broken(&index) {
            continue;
        }
        let text = |i: usize| without_brackets(tree.text_of(i)).to_owned();
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
