//! Terms of a model beyond its equations: those of effects that were found or that are tried, as extra expressions.

use super::{Expression, Model, Parameter, State};
use crate::error::{Excerpt, Fault, ModelError, Place};
use crate::limits;
use crate::nearest::nearest;
use crate::text::{self, Problem, Scope, Symbol, Tree};
use augsim_data::{Unit, shown};
use std::ops::Range;

/// A place of the equations that can be changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The rate of a state, by index.
    Rate(usize),
    /// The value of an output, by index.
    Output(usize),
    /// An input as all equations see it, by index.
    Input(usize),
    /// The delay of an input, by index.
    Delay(usize),
    /// A parameter as all equations see it, by index.
    Parameter(usize),
}

/// How an expression changes what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// The expression is added to the target.
    Add,
    /// The expression multiplies the target.
    Factor,
    /// The expression stands in place of the target.
    Replace,
}

impl How {
    /// Its key in a model file.
    pub fn key(self) -> &'static str {
        match self {
            How::Add => "add",
            How::Factor => "factor",
            How::Replace => "replace",
        }
    }
}

/// One change of the equations.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The place that it changes.
    pub target: Target,
    /// How the expression changes the target.
    pub how: How,
    /// The expression.
    pub value: Expression,
}

/// The changes that one effect makes.
#[derive(Debug, Clone, PartialEq)]
pub struct Addition {
    /// Kind of the effect, as in model files.
    pub kind: String,
    /// Name of what it changes first.
    pub on: String,
    /// Second quantity that it was bound to, where its kind has one.
    pub with: Option<String>,
    /// Its parameters among those of the model.
    pub parameters: Range<usize>,
    /// Its states among those of the model.
    pub states: Range<usize>,
    /// Its changes of the equations.
    pub changes: Vec<Change>,
    /// Other forms that fit as well, as a search wrote them.
    pub also_fits: Vec<String>,
    /// First and last knot, for a table of `with`.
    pub table: Option<(f64, f64)>,
    /// Line in the model file, from 1; that of the kind's description for one that was added later.
    pub line: usize,
}

/// An effect ready to be added to a model: texts in the names of the model, its own parameters and its own states.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Draft {
    /// See [`Addition`].
    pub kind: String,
    /// See [`Addition`].
    pub on: String,
    /// See [`Addition`].
    pub with: Option<String>,
    /// Its parameters, by their own names.
    pub parameters: Vec<Parameter>,
    /// Its states: name, rate, and the value that it begins with.
    pub states: Vec<DraftState>,
    /// Its changes: target, how, and the text of the expression.
    pub changes: Vec<(DraftTarget, String)>,
    /// See [`Addition`].
    pub also_fits: Vec<String>,
    /// See [`Addition`].
    pub table: Option<(f64, f64)>,
    /// See [`Addition`].
    pub line: usize,
}

/// The place that a text changes, and how.
pub type DraftTarget = (Target, How);

/// A state that an effect brings along.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftState {
    /// Its own name.
    pub name: String,
    /// Its change per second.
    pub rate: String,
    /// Guess of its first value: a number, or an expression as in `start`.
    pub start: String,
}

impl Addition {
    /// Name of one of its parameters as it stands in a model file.
    pub fn own_name<'n>(&self, full: &'n str) -> &'n str {
        full.rsplit('.').next().unwrap_or(full)
    }
}

/// Names as an expression of an effect sees them: its own first, then those of the model.
struct View<'m> {
    model: &'m Model,
    own: &'m [(String, Symbol)],
    /// Output that is changed: its name means its value before.
    output: Option<usize>,
    /// Whether the expression guesses a start.
    is_start: bool,
}

impl Scope for View<'_> {
    fn symbol(&self, name: &str) -> Result<Symbol, Problem> {
        let model = self.model;
        let output = || model.outputs.iter().position(|o| o.name == name);
        if let Some((_, symbol)) = self.own.iter().find(|(own, _)| own == name) {
            return Ok(*symbol);
        }
        if let Some(index) = output().filter(|o| self.is_start || self.output == Some(*o)) {
            return Ok(Symbol::Output(index));
        }
        let states = model.states.iter().map(|s| &s.name).enumerate();
        let inputs = model.inputs.iter().map(|i| &i.name).enumerate();
        let parameters = model.parameters.iter().map(|p| &p.name).enumerate();
        let lets = model.lets.iter().map(|l| &l.name).enumerate();
        let all = states
            .map(|(i, n)| (n, Symbol::State(i)))
            .chain(inputs.map(|(i, n)| (n, Symbol::Input(i))))
            .chain(parameters.map(|(i, n)| (n, Symbol::Parameter(i))))
            .chain(lets.map(|(i, n)| (n, Symbol::Let(i))));
        if name == "t" && !self.is_start {
            return Ok(Symbol::Time);
        }
        let mut known = all.clone();
        match known.find(|(n, _)| *n == name) {
            Some((_, Symbol::State(_) | Symbol::Let(_))) if self.is_start => Err(Problem::NotHere {
                name: name.into(),
                why: "a start is guessed from outputs, inputs and parameters",
            }),
            Some((_, symbol)) => Ok(symbol),
            None => {
                let known = all.map(|(n, _)| n.as_str()).chain(self.own.iter().map(|(n, _)| n.as_str()));
                Err(Problem::UnknownName { name: shown(name), nearest: nearest(name, known) })
            }
        }
    }

    fn table(&self, name: &str) -> Result<usize, Problem> {
        let tables = &self.model.tables;
        tables.iter().position(|t| t.name == name).ok_or_else(|| Problem::UnknownTable {
            name: shown(name),
            nearest: nearest(name, tables.iter().map(|t| t.name.as_str())),
        })
    }

    fn allows_slope(&self) -> bool {
        self.is_start || self.output.is_some()
    }
}

impl Model {
    /// Adds an effect: its parameters follow those of the model, its states follow the states.
    ///
    /// # Errors
    /// An expression that cannot be read, a parameter that no expression of the effect uses, or more states or parameters
    /// than a model may have.
    pub fn add(&mut self, draft: &Draft) -> Result<(), ModelError> {
        let key = format!("effect.{}", shown(&draft.kind));
        let place = |key: String| Place { file: self.file.clone(), line: draft.line, key };
        let wrong = |key: String, fault: Fault| ModelError {
            place: place(key),
            fault: Box::new(fault),
            excerpt: None,
        };
        let (first_parameter, first_state) = (self.parameters.len(), self.states.len());
        for (of, found, allowed) in [
            ("parameters", first_parameter + draft.parameters.len(), limits::PARAMETERS),
            ("states", first_state + draft.states.len(), limits::STATES),
        ] {
            if found > allowed {
                return Err(wrong(key, Fault::TooMany { of, found, allowed }));
            }
        }
        let mut own: Vec<(String, Symbol)> = Vec::new();
        for (index, p) in draft.parameters.iter().enumerate() {
            let symbol = Symbol::Parameter(first_parameter + index);
            own.push((p.name.clone(), symbol));
            // `s_V` may be written `s` in the expression.
            if let Some(short) = without_unit(&p.name)
                && !draft.parameters.iter().any(|other| other.name == short)
            {
                own.push((short.to_owned(), symbol));
            }
        }
        let states = draft.states.iter().enumerate();
        own.extend(states.map(|(index, s)| (s.name.clone(), Symbol::State(first_state + index))));
        let output = draft.changes.iter().find_map(|((target, _), _)| match target {
            Target::Output(output) => Some(*output),
            _ => None,
        });
        let parse = |field: &str, text: &str, is_start: bool| -> Result<Expression, ModelError> {
            let view = View { model: self, own: &own, output, is_start };
            let key = format!("{key}.{field}");
            let tree = text::parse(text, &view, false).map_err(|(problem, span)| ModelError {
                place: place(key.clone()),
                fault: Box::new(Fault::Expression(problem)),
                excerpt: (!span.is_empty())
                    .then(|| Box::new(Excerpt { text: text.into(), start: span.start, end: span.end })),
            })?;
            Ok(Expression { tree, line: draft.line, key })
        };
        let mut changes = Vec::new();
        for ((target, how), text) in &draft.changes {
            changes.push(Change { target: *target, how: *how, value: parse(how.key(), text, false)? });
        }
        let mut added = Vec::new();
        for state in &draft.states {
            added.push(State {
                name: format!("{}.{}", self.free_prefix(draft), state.name),
                unit: None,
                start: parse("start", &state.start, true)?,
                sd: None,
                min: None,
                max: None,
                shared: false,
                shaken: None,
                rate: parse("states", &state.rate, false)?,
                line: draft.line,
            });
        }
        let trees = || changes.iter().map(|c| &c.value.tree).chain(added.iter().map(|s| &s.rate.tree));
        for (index, p) in draft.parameters.iter().enumerate() {
            let symbol = Symbol::Parameter(first_parameter + index);
            let is_delay = changes.iter().any(|c| matches!(c.target, Target::Delay(_)));
            if !is_delay && !trees().any(|tree| tree.symbols().any(|s| s == symbol)) {
                return Err(wrong(format!("{key}.{}", shown(&p.name)), Fault::Unused));
            }
        }
        let prefix = self.free_prefix(draft);
        for change in &changes {
            if let Target::Delay(input) = change.target {
                self.inputs[input].delay = Some(first_parameter);
            }
        }
        let named = |p: &Parameter| Parameter { name: format!("{prefix}.{}", p.name), ..p.clone() };
        self.parameters.extend(draft.parameters.iter().map(named));
        self.states.extend(added);
        self.additions.push(Addition {
            kind: draft.kind.clone(),
            on: draft.on.clone(),
            with: draft.with.clone(),
            parameters: first_parameter..self.parameters.len(),
            states: first_state..self.states.len(),
            changes,
            also_fits: draft.also_fits.clone(),
            table: draft.table,
            line: draft.line,
        });
        Ok(())
    }

    /// Tree of a text in the names of the model; nothing where it is no expression of them.
    pub(crate) fn tree_of(&self, text: &str) -> Option<Tree> {
        // An output that bears no other name is seen too.
        let free = |name: &str| self.state(name).is_none() && self.parameter(name).is_none();
        let output = self.outputs.iter().position(|o| o.name == text && free(text));
        text::parse(text, &View { model: self, own: &[], output, is_start: false }, false).ok()
    }

    /// Prefix of the names of an effect's parameters: its kind, with what it changes where the kind is there already.
    fn free_prefix(&self, draft: &Draft) -> String {
        let taken = |prefix: &str| {
            let begins = |name: &str| name.strip_prefix(prefix).is_some_and(|rest| rest.starts_with('.'));
            self.parameters.iter().any(|p| begins(&p.name)) || self.states.iter().any(|s| begins(&s.name))
        };
        let longer = format!("{} on {}", draft.kind, draft.on);
        let mut prefix = if taken(&draft.kind) { longer.clone() } else { draft.kind.clone() };
        let mut count = 1;
        while taken(&prefix) {
            count += 1;
            prefix = format!("{longer} ({count})");
        }
        prefix
    }

    /// Number of parameters that stand before those of the first addition.
    pub fn declared_parameters(&self) -> usize {
        self.additions.first().map_or(self.parameters.len(), |a| a.parameters.start)
    }

    /// Number of states that stand before those of the first addition.
    pub fn declared_states(&self) -> usize {
        self.additions.first().map_or(self.states.len(), |a| a.states.start)
    }

    /// Trees of an addition's changes and of its states' rates.
    pub(crate) fn added_trees(&self) -> impl Iterator<Item = &Tree> {
        self.additions.iter().flat_map(|a| a.changes.iter().map(|c| &c.value.tree))
    }
}

/// A name without the unit at its end, if it states one.
fn without_unit(name: &str) -> Option<&str> {
    Unit::of_column_name(name)?;
    // The shortest end that states all of the unit has no other word in it.
    let cut = name.match_indices('_').map(|(at, _)| at);
    let mut cuts = cut.filter(|at| {
        *at > 0 && Unit::of_column_name(&format!("q{}", &name[*at..])) == Unit::of_column_name(name)
    });
    cuts.next_back().map(|at| &name[..at])
}

#[cfg(test)]
mod tests {
    //! Contract: a parameter may be written without its unit, and with nothing else left out.
    use super::*;

    #[test]
    fn the_unit_alone_is_cut() {
        assert_eq!(without_unit("s_V"), Some("s"));
        assert_eq!(without_unit("level_rad_s2"), Some("level"));
        assert_eq!(without_unit("width_of_knee_m_s"), Some("width_of_knee"));
        assert_eq!(without_unit("c"), None);
    }
}
