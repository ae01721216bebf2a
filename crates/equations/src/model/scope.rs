//! Resolves the names in the expressions of a model file, depending on the place of the expression.

use crate::nearest::nearest;
use crate::text::{Problem, Scope, Symbol};

/// Names that are declared in a model file so far.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// Names of states, inputs, parameters and `[let]` values, each group in its order.
    pub(super) quantities: Vec<(String, Symbol)>,
    /// Line in the file of each `[let]` value.
    pub(super) let_lines: Vec<usize>,
    pub(super) outputs: Vec<String>,
    pub(super) tables: Vec<String>,
    /// Names of the joints of `[robot]`.
    pub(super) joints: Vec<String>,
}

/// The kind of place of an expression in a model file, which decides what names it may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Site {
    /// The expression of a `[let]` value, given by its index.
    Let(usize),
    /// The expression of a rate, an output or an event.
    Equation,
    /// The expression of an initial value.
    Start,
}

/// The names that an expression on `line` of the file may use.
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
            (Symbol::Let(index), Site::Let(this)) if index == this => Err(Problem::NamesItself),
            (Symbol::Let(index), site) if site != Site::Start => {
                let is_defined_before = match site {
                    Site::Let(this) => index < this,
                    _ => names.let_lines.get(index).is_none_or(|line| *line < self.line),
                };
                if is_defined_before { Ok(*symbol) } else { Err(Problem::DefinedLater { name: name.into() }) }
            }
            (Symbol::State(_) | Symbol::Let(_), Site::Start) => Err(Problem::NotHere {
                name: name.into(),
                why: "a start value may use only outputs, inputs and parameters",
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

    fn joint(&self, name: &str) -> Result<usize, Problem> {
        joint_named(name, &self.names.joints)
    }

    fn allows_slope(&self) -> bool {
        self.site == Site::Start
    }
}

/// Finds the index of a joint by its name.
pub(super) fn joint_named(name: &str, joints: &[String]) -> Result<usize, Problem> {
    joints.iter().position(|joint| joint == name).ok_or_else(|| Problem::UnknownJoint {
        name: augsim_data::escaped_short(name),
        nearest: nearest(name, joints.iter().map(String::as_str)),
    })
}

impl View<'_> {
    /// Describes a name that is unknown, or an output where outputs are not allowed.
    fn unknown(&self, name: &str) -> Problem {
        let is_output = self.names.outputs.iter().any(|n| n == name);
        if is_output {
            let why = "an output is a measured quantity; use the states that it is computed from";
            return Problem::NotHere { name: name.into(), why };
        }
        let outputs = self.names.outputs.iter().filter(|_| self.site == Site::Start);
        let known = self.names.quantities.iter().map(|(n, _)| n).chain(outputs);
        let nearest = nearest(name, known.map(String::as_str));
        Problem::UnknownName { name: augsim_data::escaped_short(name), nearest }
    }
}
