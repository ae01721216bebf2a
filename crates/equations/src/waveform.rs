//! Inputs given as expressions of time, for simulations without data.

use crate::error::{Excerpt, Fault, ModelError, Place};
use crate::text::{self, Bindings, Problem, Scope, Symbol, Tree};
use augsim_data::escaped_short;

/// A function of time, read from an expression of `t`.
#[derive(Debug, Clone, PartialEq)]
pub struct Waveform {
    tree: Tree,
}

/// Scope in which `t` is the only name.
struct TimeScope;

impl Scope for TimeScope {
    fn symbol(&self, name: &str) -> Result<Symbol, Problem> {
        match name {
            "t" => Ok(Symbol::Time),
            _ => Err(Problem::UnknownName { name: escaped_short(name), nearest: Some("t".into()) }),
        }
    }

    fn table(&self, name: &str) -> Result<usize, Problem> {
        Err(Problem::UnknownTable { name: escaped_short(name), nearest: None })
    }
}

/// The time at which a waveform is evaluated, s.
struct TimePoint(f64);

impl Bindings for TimePoint {
    fn symbol(&self, symbol: Symbol) -> f64 {
        if symbol == Symbol::Time { self.0 } else { 0.0 }
    }

    fn table(&self, _table: usize, _at: f64) -> f64 {
        0.0
    }

    fn slope(&self, _output: usize) -> f64 {
        0.0
    }
}

impl Waveform {
    /// Parses an expression of `t` (s); `from` names the expression's origin in messages.
    ///
    /// # Errors
    /// The first problem, with the text and a caret.
    pub fn parse(text: &str, from: &str) -> Result<Self, ModelError> {
        let tree = text::parse(text, &TimeScope, false).map_err(|(problem, span)| ModelError {
            place: Place { file: from.into(), line: 1, key: String::new() },
            fault: Box::new(Fault::Expression(problem)),
            excerpt: (!span.is_empty())
                .then(|| Box::new(Excerpt { text: text.into(), start: span.start, end: span.end })),
        })?;
        Ok(Self { tree })
    }

    /// Value of the function at a time, s.
    pub fn at(&self, time_s: f64) -> f64 {
        self.tree.value(&TimePoint(time_s))
    }
}
