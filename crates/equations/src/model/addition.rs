//! Effects of a model: changes of its equations, as additional expressions.

use super::{Expression, Model, Parameter, State};
use crate::error::{Fault, ModelError, Place};
use crate::limits;
use crate::nearest::nearest;
use crate::text::{self, Kind, Problem, Scope, Symbol, Tree};
use augsim_data::{Unit, escaped_short};
use std::ops::Range;

/// A quantity of the equations that an effect can change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The rate of a state, given by the index of the state.
    Rate(usize),
    /// The value of an output, given by the index of the output.
    Output(usize),
    /// An input as all equations use it, given by its index.
    Input(usize),
    /// The delay of an input, given by the index of the input.
    Delay(usize),
    /// A parameter as all equations use it, given by its index.
    Parameter(usize),
    /// The torque on a joint of the robot, given by the index of the joint.
    ///
    /// It adds to the torque of the drive, before the mass matrix; in the inverse dynamics it is subtracted.
    Joint(usize),
    /// An inertial parameter of a link of the robot: index of the link in the tree, and of the parameter (0 to 9).
    Inertia(usize, usize),
    /// The inertia of the rotor of a joint of the robot, given by the index of the joint.
    Armature(usize),
    /// The acceleration of gravity along an axis of the robot's base (0 to 2), m/s2.
    Gravity(usize),
    /// A generalised force of the external function, given by its index.
    Force(usize),
}

/// How an effect's expression changes its target: it is added, multiplied, or replaces it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// The expression is added to the target.
    Add,
    /// The expression multiplies the target.
    Factor,
    /// The expression replaces the target.
    Replace,
}

impl How {
    /// Key that introduces this kind of change in a model file.
    pub fn key(self) -> &'static str {
        match self {
            How::Add => "add",
            How::Factor => "factor",
            How::Replace => "replace",
        }
    }
}

/// One change that an effect makes to the equations.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The quantity that the effect changes.
    pub target: Target,
    /// How the expression changes the target.
    pub how: How,
    /// The expression that is added to, multiplies or replaces the target.
    pub value: Expression,
}

/// An effect in a model: the changes that it makes to the equations, with its parameters and states.
#[derive(Debug, Clone, PartialEq)]
pub struct Addition {
    /// Kind of the effect, as in model files.
    pub kind: String,
    /// Name of the first quantity that the effect changes.
    pub on: String,
    /// Second quantity that the effect depends on or changes; `None` if its kind has none.
    pub with: Option<String>,
    /// The effect's parameters, as a range of indices into those of the model.
    pub parameters: Range<usize>,
    /// The effect's states, as a range of indices into those of the model.
    pub states: Range<usize>,
    /// The changes that the effect makes to the equations.
    pub changes: Vec<Change>,
    /// Texts of other expressions that fit equally well, as discovery wrote them into the file.
    pub equivalent_expressions: Vec<String>,
    /// First and last knot of a table effect, in the unit of the quantity `with`; `None` for other effects.
    pub table: Option<(f64, f64)>,
    /// Line of the effect in the model file, from 1; for an effect that was added later, the line of its row.
    pub line: usize,
}

/// An effect that is ready to be added to a model; its expressions are texts that are not parsed yet.
///
/// The expressions use names of the model, of the effect's parameters and of its states.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Draft {
    /// Kind of the effect, as in model files.
    pub kind: String,
    /// Name of the first quantity that the effect changes.
    pub on: String,
    /// Second quantity that the effect depends on or changes; `None` if its kind has none.
    pub with: Option<String>,
    /// Parameters of the effect, with names local to it.
    pub parameters: Vec<Parameter>,
    /// States of the effect, with names local to it.
    pub states: Vec<DraftState>,
    /// Changes of the equations: target, how it is changed, and the text of the expression.
    pub changes: Vec<(DraftTarget, String)>,
    /// Other expressions that fit equally well, as discovery wrote them.
    pub equivalent_expressions: Vec<String>,
    /// First and last knot of a table effect, in the unit of the quantity `with`; `None` for other effects.
    pub table: Option<(f64, f64)>,
    /// Line of the effect in the model file, from 1; for an effect that was added later, the line of its row.
    pub line: usize,
}

/// The quantity that a change acts on, and how it is changed.
pub type DraftTarget = (Target, How);

/// A state that an effect brings with it.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftState {
    /// Name of the state, local to the effect.
    pub name: String,
    /// Text of the expression of the state's rate, per second.
    pub rate: String,
    /// Initial value of the state: a number, or the text of an expression as under `start` in a model file.
    pub start: String,
    /// Quantity whose root mean square is the standard deviation of the initial value about `start`.
    pub spread: Option<String>,
    /// Standard deviation of the initial value about `start`; `None` until it is computed from data.
    pub sd: Option<f64>,
}

impl Addition {
    /// Name of a parameter of the effect as in a model file: without the prefix used in the model.
    pub fn local_name<'n>(&self, full: &'n str) -> &'n str {
        full.rsplit('.').next().unwrap_or(full)
    }
}

/// Resolves names in an expression of an effect: first names local to the effect, then those of the model.
struct View<'m> {
    model: &'m Model,
    /// Names local to the effect, with their symbols in the model.
    local_names: &'m [(String, Symbol)],
    /// Output that the effect changes; its name in the expression stands for its value before. `None` for
    /// other targets.
    output: Option<usize>,
    /// Whether the expression is the initial value of a state.
    is_start: bool,
}

impl Scope for View<'_> {
    fn symbol(&self, name: &str) -> Result<Symbol, Problem> {
        let model = self.model;
        let output = || model.outputs.iter().position(|o| o.name == name);
        if let Some((_, symbol)) = self.local_names.iter().find(|(local_names, _)| local_names == name) {
            return Ok(*symbol);
        }
        if let Some(index) = output().filter(|o| self.is_start || self.output == Some(*o)) {
            return Ok(Symbol::Output(index));
        }
        let states = model.states.iter().map(|s| &s.name).enumerate();
        let inputs = model.inputs.iter().map(|i| &i.name).enumerate();
        let parameters = model.parameters.iter().map(|p| &p.name).enumerate();
        let lets = model.lets.iter().map(|l| &l.name).enumerate();
        let quantities = states
            .map(|(i, n)| (n, Symbol::State(i)))
            .chain(inputs.map(|(i, n)| (n, Symbol::Input(i))))
            .chain(parameters.map(|(i, n)| (n, Symbol::Parameter(i))))
            .chain(lets.map(|(i, n)| (n, Symbol::Let(i))));
        if name == "t" && !self.is_start {
            return Ok(Symbol::Time);
        }
        let mut known_names = quantities.clone();
        match known_names.find(|(n, _)| *n == name) {
            Some((_, Symbol::Let(_))) if self.is_start => Err(Problem::NotHere {
                name: name.into(),
                why: "a start value may use only outputs, states, inputs and parameters",
            }),
            Some((_, symbol)) => Ok(symbol),
            None => {
                let known_names = quantities
                    .map(|(n, _)| n.as_str())
                    .chain(self.local_names.iter().map(|(n, _)| n.as_str()));
                Err(Problem::UnknownName { name: escaped_short(name), nearest: nearest(name, known_names) })
            }
        }
    }

    fn table(&self, name: &str) -> Result<usize, Problem> {
        let tables = &self.model.tables;
        tables.iter().position(|t| t.name == name).ok_or_else(|| Problem::UnknownTable {
            name: escaped_short(name),
            nearest: nearest(name, tables.iter().map(|t| t.name.as_str())),
        })
    }

    fn joint(&self, name: &str) -> Result<usize, Problem> {
        let joints: Vec<String> = self.model.robot.iter().flat_map(|r| r.joint_names()).collect();
        super::scope::joint_named(name, &joints)
    }

    fn allows_slope(&self) -> bool {
        self.is_start || self.output.is_some()
    }
}

impl Model {
    /// Adds an effect to the model; its parameters and states follow those of the model.
    ///
    /// # Errors
    /// An expression that cannot be parsed, a parameter that the effect does not use, or more states or
    /// parameters than a model may have.
    pub fn add(&mut self, draft: &Draft) -> Result<(), ModelError> {
        let (first_parameter, first_state) = (self.parameters.len(), self.states.len());
        let reader = DraftReader::new(self, draft);
        reader.check_limits()?;
        let changes = reader.changes()?;
        let prefix = self.free_prefix(draft);
        let states = reader.states(&prefix)?;
        reader.check_parameters_are_used(&changes, &states)?;
        for change in &changes {
            if let Target::Delay(input) = change.target {
                self.inputs[input].delay = Some(first_parameter);
            }
        }
        let with_prefix = |p: &Parameter| Parameter { name: format!("{prefix}.{}", p.name), ..p.clone() };
        self.parameters.extend(draft.parameters.iter().map(with_prefix));
        self.states.extend(states);
        self.additions.push(Addition {
            kind: draft.kind.clone(),
            on: draft.on.clone(),
            with: draft.with.clone(),
            parameters: first_parameter..self.parameters.len(),
            states: first_state..self.states.len(),
            changes,
            equivalent_expressions: draft.equivalent_expressions.clone(),
            table: draft.table,
            line: draft.line,
        });
        Ok(())
    }

    /// Parses an expression in the names of the model; `None` if it is not valid.
    pub(crate) fn tree_of(&self, text: &str) -> Option<Tree> {
        // An output is allowed as well if no state or parameter has its name.
        let is_free = |name: &str| self.state(name).is_none() && self.parameter(name).is_none();
        let output = self.outputs.iter().position(|o| o.name == text && is_free(text));
        text::parse(text, &View { model: self, local_names: &[], output, is_start: false }, false).ok()
    }

    /// Prefix of the names of an effect's parameters in the model: the effect's kind.
    ///
    /// The target and a number are added if needed to make the prefix unique.
    fn free_prefix(&self, draft: &Draft) -> String {
        let is_taken = |prefix: &str| {
            let has_prefix = |name: &str| name.strip_prefix(prefix).is_some_and(|rest| rest.starts_with('.'));
            self.parameters.iter().any(|p| has_prefix(&p.name))
                || self.states.iter().any(|s| has_prefix(&s.name))
        };
        let longer = format!("{} on {}", draft.kind, draft.on);
        let mut prefix = if is_taken(&draft.kind) { longer.clone() } else { draft.kind.clone() };
        let mut count = 1;
        while is_taken(&prefix) {
            count += 1;
            prefix = format!("{longer} ({count})");
        }
        prefix
    }

    /// Number of declared parameters: those before the parameters of the first effect.
    pub fn declared_parameters(&self) -> usize {
        self.additions.first().map_or(self.parameters.len(), |a| a.parameters.start)
    }

    /// Number of declared states: those before the states of the first effect.
    pub fn declared_states(&self) -> usize {
        self.additions.first().map_or(self.states.len(), |a| a.states.start)
    }

    /// Expressions of the changes that all effects of the model make.
    pub(crate) fn added_trees(&self) -> impl Iterator<Item = &Tree> {
        self.additions.iter().flat_map(|a| a.changes.iter().map(|c| &c.value.tree))
    }
}

/// Parses and checks an effect before it is added to the model.
struct DraftReader<'m> {
    model: &'m Model,
    draft: &'m Draft,
    local_names: Vec<(String, Symbol)>,
    /// Output that the effect changes; `None` for other targets.
    output: Option<usize>,
    /// First part of the keys that error messages name.
    key: String,
}

impl<'m> DraftReader<'m> {
    fn new(model: &'m Model, draft: &'m Draft) -> Self {
        let output = draft.changes.iter().find_map(|((target, _), _)| match target {
            Target::Output(output) => Some(*output),
            _ => None,
        });
        DraftReader {
            model,
            draft,
            local_names: local_names(draft, model.parameters.len(), model.states.len()),
            output,
            key: format!("effect.{}", escaped_short(&draft.kind)),
        }
    }

    fn place(&self, key: String) -> Place {
        Place { file: self.model.file.clone(), line: self.draft.line, key }
    }

    fn error(&self, key: String, fault: Fault) -> ModelError {
        ModelError { place: self.place(key), fault: Box::new(fault), excerpt: None }
    }

    /// Checks that the model, with the effect added, has no more parameters and states than allowed.
    fn check_limits(&self) -> Result<(), ModelError> {
        let (model, draft) = (self.model, self.draft);
        for (what, found, allowed) in [
            ("parameters", model.parameters.len() + draft.parameters.len(), limits::MAX_PARAMETERS),
            ("states", model.states.len() + draft.states.len(), limits::MAX_STATES),
        ] {
            if found > allowed {
                return Err(self.error(self.key.clone(), Fault::TooMany { what, found, allowed }));
            }
        }
        Ok(())
    }

    fn parse(&self, field: &str, text: &str, is_start: bool) -> Result<Expression, ModelError> {
        let view = View { model: self.model, local_names: &self.local_names, output: self.output, is_start };
        let key = format!("{}.{field}", self.key);
        let tree = text::parse(text, &view, false)
            .map_err(|failure| ModelError::in_expression(self.place(key.clone()), text, failure))?;
        Ok(Expression { tree, line: self.draft.line, key })
    }

    /// Parses the `start` of a state of the effect.
    ///
    /// An output that is the value of a declared state stands for that state: its first reading has noise.
    fn start(&self, text: &str) -> Result<Expression, ModelError> {
        let mut start = self.parse("start", text, true)?;
        if let [node] = &mut start.tree.nodes[..]
            && let Kind::Symbol(Symbol::Output(output)) = node.kind
            && let Some(state) = self.model.state_of_output(output)
        {
            node.kind = Kind::Symbol(Symbol::State(state));
        }
        Ok(start)
    }

    /// Parses the changes that the effect makes to the equations.
    fn changes(&self) -> Result<Vec<Change>, ModelError> {
        let change = |((target, how), text): &(DraftTarget, String)| {
            Ok(Change { target: *target, how: *how, value: self.parse(how.key(), text, false)? })
        };
        self.draft.changes.iter().map(change).collect()
    }

    /// Parses the states of the effect, whose names in the model begin with `prefix`.
    fn states(&self, prefix: &str) -> Result<Vec<State>, ModelError> {
        let state = |state: &DraftState| {
            Ok(State {
                name: format!("{prefix}.{}", state.name),
                unit: None,
                start: self.start(&state.start)?,
                sd: state.sd,
                min: None,
                max: None,
                shared: false,
                process_noise: None,
                rate: self.parse("states", &state.rate, false)?,
                line: self.draft.line,
            })
        };
        self.draft.states.iter().map(state).collect()
    }

    /// Checks that an effect's expressions use each of its parameters, unless the effect is a delay.
    fn check_parameters_are_used(&self, changes: &[Change], states: &[State]) -> Result<(), ModelError> {
        if changes.iter().any(|c| matches!(c.target, Target::Delay(_))) {
            return Ok(());
        }
        let first_parameter = self.model.parameters.len();
        for (index, p) in self.draft.parameters.iter().enumerate() {
            let symbol = Symbol::Parameter(first_parameter + index);
            let mut trees = changes.iter().map(|c| &c.value.tree).chain(states.iter().map(|s| &s.rate.tree));
            if !trees.any(|tree| tree.symbols().any(|s| s == symbol)) {
                let key = format!("{}.{}", self.key, escaped_short(&p.name));
                return Err(self.error(key, Fault::Unused));
            }
        }
        Ok(())
    }
}

/// The names of an effect's parameters and states, and the symbols that they will have in the model.
fn local_names(draft: &Draft, first_parameter: usize, first_state: usize) -> Vec<(String, Symbol)> {
    let mut names: Vec<(String, Symbol)> = Vec::new();
    for (index, p) in draft.parameters.iter().enumerate() {
        let symbol = Symbol::Parameter(first_parameter + index);
        names.push((p.name.clone(), symbol));
        // A parameter `s_V` may be written `s` in the expression.
        if let Some(short) = without_unit(&p.name)
            && !draft.parameters.iter().any(|other| other.name == short)
        {
            names.push((short.to_owned(), symbol));
        }
    }
    let states = draft.states.iter().enumerate();
    names.extend(states.map(|(index, s)| (s.name.clone(), Symbol::State(first_state + index))));
    names
}

/// Strips the unit from the end of a name; `None` if the name has no unit.
fn without_unit(name: &str) -> Option<&str> {
    Unit::from_column_name(name)?;
    // The shortest ending that gives the whole unit contains no other word.
    let underscores = name.match_indices('_').map(|(at, _)| at);
    let mut cuts = underscores.filter(|at| {
        *at > 0 && Unit::from_column_name(&format!("q{}", &name[*at..])) == Unit::from_column_name(name)
    });
    cuts.next_back().map(|at| &name[..at])
}

#[cfg(test)]
mod tests {
    //! Contract: a parameter may be written without its unit, but with nothing else left out.
    use super::*;

    #[test]
    fn only_the_unit_is_removed() {
        assert_eq!(without_unit("s_V"), Some("s"));
        assert_eq!(without_unit("level_rad_s2"), Some("level"));
        assert_eq!(without_unit("width_of_knee_m_s"), Some("width_of_knee"));
        assert_eq!(without_unit("c"), None);
    }
}
