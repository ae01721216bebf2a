//! Names and their meaning, depending on where an expression stands.

use crate::nearest::nearest;
use crate::text::{Problem, Scope, Symbol};

/// Names declared so far.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// States, inputs and parameters, with `[let]` values in their order.
    pub(super) quantities: Vec<(String, Symbol)>,
    /// Line of each `[let]` value, by its index.
    pub(super) let_lines: Vec<usize>,
    pub(super) outputs: Vec<String>,
    pub(super) tables: Vec<String>,
}

/// Where an expression stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Site {
    /// A value of `[let]`, by its index.
    Let(usize),
    /// A rate, an output or an event.
    Equation,
    /// The guess of a start state.
    Start,
}

/// Names as an expression on `line` of the file sees them.
pub(super) struct View<'n> {
    pub(super) names: &'n Names,
    pub(super) site: Site,
    pub(super) line: usize,
}

impl Scope for View<'_> {
    fn symbol(&self, name: &str) -> Result<Symbol, Problem> {
        let names = self.names;
        if self.site == Site::Start {
            if let Some(output) = names.outputs.iter().position(|n| n == name) {
                return Ok(Symbol::Output(output));
            }
        } else if name == "t" {
            return Ok(Symbol::Time);
        }
        let Some((_, symbol)) = names.quantities.iter().find(|(n, _)| n == name) else {
            return Err(self.unknown(name));
        };
        match (*symbol, self.site) {
            (Symbol::Let(index), Site::Let(own)) if index == own => Err(Problem::NamesItself),
            (Symbol::Let(index), site) if site != Site::Start => {
                let ordered = match site {
                    Site::Let(own) => index < own,
                    _ => names.let_lines.get(index).is_none_or(|line| *line < self.line),
                };
                if ordered { Ok(*symbol) } else { Err(Problem::DefinedLater { name: name.into() }) }
            }
            (Symbol::State(_) | Symbol::Let(_), Site::Start) => Err(Problem::NotHere {
                name: name.into(),
                why: "a start is guessed from outputs, inputs and parameters",
            }),
            _ => Ok(*symbol),
        }
    }

    fn table(&self, name: &str) -> Result<usize, Problem> {
        let tables = &self.names.tables;
        tables.iter().position(|n| n == name).ok_or_else(|| Problem::UnknownTable {
            name: name.into(),
            nearest: nearest(name, tables.iter().map(String::as_str)),
        })
    }

    fn allows_slope(&self) -> bool {
        self.site == Site::Start
    }
}

impl View<'_> {
    fn unknown(&self, name: &str) -> Problem {
        let is_output = self.names.outputs.iter().any(|n| n == name);
        if is_output {
            let why = "an output is what is measured; use the states that it is made of";
            return Problem::NotHere { name: name.into(), why };
        }
        let outputs = self.names.outputs.iter().filter(|_| self.site == Site::Start);
        let known = self.names.quantities.iter().map(|(n, _)| n).chain(outputs);
        let nearest = nearest(name, known.map(String::as_str));
        Problem::UnknownName { name: augsim_data::shown(name), nearest }
    }
}
