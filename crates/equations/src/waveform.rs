//! Inputs given as expressions of time, for simulations without data.

use crate::error::{ModelError, Place};
use crate::text::{self, Problem, Scope, Symbol, Tree};
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

impl Waveform {
    /// Parses an expression of `t` (s); `from` names the expression's origin in messages.
    ///
    /// # Errors
    /// The first problem, with the text and a caret.
    pub fn parse(text: &str, from: &str) -> Result<Self, ModelError> {
        let tree = text::parse(text, &TimeScope, false).map_err(|failure| {
            let place = Place { file: from.into(), line: 1, key: String::new() };
            ModelError::in_expression(place, text, failure)
        })?;
        Ok(Self { tree })
    }

    /// Value of the function at a time, s.
    pub fn at(&self, time_s: f64) -> f64 {
        self.tree.value_of(&|_| time_s)
    }
}
