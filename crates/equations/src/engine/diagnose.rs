//! Finds the operation that made a state infinite or NaN, for the message of a divergence.

use super::{Options, SimulationError, Window};
use crate::model::{How, Model, Target};
use crate::system::System;
use crate::text::{Bindings, Kind, Symbol, Tree};

/// Describes the divergence of a window, in which state number `state` is not finite at sample `index`.
pub(crate) fn diverged(
    system: &System,
    window: &Window<'_>,
    index: usize,
    state: usize,
    options: &Options,
) -> SimulationError {
    let sample = (window.first + index).min(window.last);
    let last_finite = sample.saturating_sub(1).max(window.first);
    let name = |state: usize| system.model.states[state].name.clone();
    // Simulate again up to the last finite sample: the cause is in the rates there or within the next
    // interval.
    let shorter = Window { last: last_finite, ..window.clone() };
    // A start that is not finite has no such sample, and simulating it again would recurse without end.
    let run = (index > 0).then(|| system.simulate(std::slice::from_ref(&shorter), &[], options).pop());
    let start = match run.flatten() {
        Some(Ok(simulated)) => simulated.end,
        _ => window.start.to_vec(),
    };
    let times = &window.record.times;
    let mut error = SimulationError::NotFinite {
        record: window.record.name.clone(),
        time: times[sample],
        state: name(state),
        cause: None,
    };
    // The equations of an external function do not show what is not finite in them.
    if system.model.external.is_some() {
        return error;
    }
    // Small explicit Euler steps from there find the first rate that is not finite, and the state at which it
    // occurs.
    let steps = 1000 * options.substeps.max(1);
    let h = (times[sample] - times[last_finite]) / steps as f64;
    let mut x = start;
    for step in 0..=steps {
        let time = times[last_finite] + h * step as f64;
        let values = PointValues::new(&system.model, window, &x, time);
        let mut rates = Vec::with_capacity(x.len());
        for state in 0..x.len() {
            let rate = values.rate(state);
            if !rate.is_finite() {
                if let SimulationError::NotFinite { time: error_time, state: error_state, cause, .. } =
                    &mut error
                {
                    (*error_time, *error_state) = (time, name(state));
                    *cause = values.cause(state);
                }
                return error;
            }
            rates.push(rate);
        }
        x.iter_mut().zip(&rates).for_each(|(x, rate)| *x += h * rate);
    }
    error
}

/// Values of all quantities that an expression may use, at one point of a window.
struct PointValues<'s> {
    model: &'s Model,
    window: &'s Window<'s>,
    x: &'s [f64],
    time: f64,
    /// Values of `[let]` that are computed so far.
    lets: Vec<f64>,
}

impl<'s> PointValues<'s> {
    fn new(model: &'s Model, window: &'s Window<'s>, x: &'s [f64], time: f64) -> Self {
        let mut values = PointValues { model, window, x, time, lets: Vec::new() };
        for declared in &model.lets {
            let value = declared.value.tree.value(&values);
            values.lets.push(value);
        }
        values
    }

    /// Rate of a state, with the effects on it.
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

    /// Describes why the rate of a state is not finite; `None` if no cause is found.
    ///
    /// The cause is in the first `[let]` value that is not finite, or else in the expression of the rate.
    fn cause(&self, state: usize) -> Option<String> {
        let values = self.model.lets.iter().zip(&self.lets);
        let first_infinite = values.into_iter().find(|(_, value)| !value.is_finite());
        let rate_trees = std::iter::once(&self.model.states[state].rate.tree).chain(self.model.added_trees());
        let trees = first_infinite.map(|(declared, _)| &declared.value.tree).into_iter().chain(rate_trees);
        trees.into_iter().find_map(|tree| cause_in(tree, &tree.values(self)))
    }
}

impl Bindings for PointValues<'_> {
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
            Symbol::JointTorque(_) | Symbol::JointAcceleration(_) => {
                self.model.robot.as_ref().map_or(0.0, |robot| robot.value(symbol, self))
            }
            Symbol::Output(_) | Symbol::ExternalRate(_) => 0.0,
        }
    }

    fn table(&self, table: usize, at: f64) -> f64 {
        self.model.tables.get(table).map_or(0.0, |t| t.value(at))
    }

    fn slope(&self, _output: usize) -> f64 {
        0.0
    }
}

/// Describes the first node of an expression that is not finite although its operands are.
fn cause_in(tree: &Tree, values: &[f64]) -> Option<String> {
    let is_broken = |i: &usize| !values[*i].is_finite();
    for (index, node) in tree.nodes.iter().enumerate() {
        if !is_broken(&index) {
            continue;
        }
        let text = |i: usize| augsim_data::escaped_short(without_outer_parentheses(tree.text_of(i)));
        return Some(match &node.kind {
            Kind::Divide(a, b) if !is_broken(a) && values[*b] == 0.0 => {
                format!("division by `{}` = 0", text(*b))
            }
            Kind::Call(function, arguments) if !arguments.iter().any(is_broken) => {
                let z = arguments.first().map_or(0.0, |a| values[*a]);
                let argument = arguments.first().map_or_else(String::new, |a| text(*a));
                format!("`{}` of `{argument}` = {z}", function.name())
            }
            Kind::Power(a, b) if !is_broken(a) && !is_broken(b) => {
                format!("`{}` = {} to the power of `{}` = {}", text(*a), values[*a], text(*b), values[*b])
            }
            Kind::Symbol(_) => continue,
            _ => format!("`{}` is {}", text(index), values[index]),
        });
    }
    None
}

/// Strips a pair of parentheses that encloses the whole text.
fn without_outer_parentheses(text: &str) -> &str {
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
