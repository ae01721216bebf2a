//! Reads the expressions of a model file in a second pass, after all names are known.

use super::entries::{check_name, known_with, section, suffixed};
use super::scope::{Names, Site, View};
use super::toml_reader::{Item, Value};
use super::{Direction, Event, Expression, Integrator, Let, Model, Numerics, Rest, units};
use crate::error::{Fault, ModelError};
use crate::limits;
use crate::nearest::nearest;
use crate::text::{self, Problem, Tree};
use augsim_data::{Dimensions, Unit, escaped_short};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The second pass over a model file, which reads the expressions.
pub(super) struct Equations<'n> {
    names: &'n Names,
    /// Number of nodes of all expressions read so far.
    nodes: usize,
}

impl<'n> Equations<'n> {
    pub(super) fn new(names: &'n Names) -> Self {
        Self { names, nodes: 0 }
    }

    /// Reads all expressions into `model`, whose names and numbers are read already.
    pub(super) fn read(
        mut self,
        file: &Item<'_, '_>,
        robot: Option<super::robot::Declared>,
        model: &mut Model,
    ) -> Result<(), ModelError> {
        for (index, (name, item)) in
            section(file, "let", "values", limits::MAX_PARAMETERS)?.into_iter().enumerate()
        {
            let value = self.expression(&item, Site::Let(index), false)?;
            let dimensions_of_name = || Unit::from_column_name(name).map(Unit::dimensions);
            let dimensions = infer(model, &item, &value.tree)?.or_else(dimensions_of_name);
            model.lets.push(Let { name: name.into(), dimensions, value });
        }
        self.states(file, model)?;
        for (index, (_, item)) in
            section(file, "outputs", "outputs", limits::MAX_OUTPUTS)?.into_iter().enumerate()
        {
            let value = match item.value.get_ref().as_str() {
                Some(_) => self.expression(&item, Site::Equation, false)?,
                None => {
                    let example = "value = \"x_m\"";
                    let missing = || item.error(Fault::Missing { key: "value", example });
                    let mut value = item.entry("value").ok_or_else(missing)?;
                    value.key.clone_from(&item.key);
                    self.expression(&value, Site::Equation, false)?
                }
            };
            infer(model, &item, &value.tree)?;
            model.outputs[index].value = value;
        }
        self.events(file, model)?;
        if let Some(declared) = robot {
            let robot = declared.complete(file, model, |item| {
                // A torque may use any value of [let], wherever [robot] is in the file.
                let at_end = Item { line: usize::MAX, ..item.clone() };
                let read = self.expression(&at_end, Site::Equation, false);
                read.map(|expression| Expression { line: item.line, ..expression }).map_err(|mut e| {
                    e.place.line = item.line;
                    e
                })
            })?;
            model.robot = Some(Arc::new(robot));
        }
        model.numerics = numerics(file)?;
        Ok(())
    }

    /// Reads the initial values and rates of the states, and checks the units of the rates.
    fn states(&mut self, file: &Item<'_, '_>, model: &mut Model) -> Result<(), ModelError> {
        let rates: BTreeMap<&str, Item<'_, '_>> =
            section(file, "rates", "rates", usize::MAX)?.into_iter().collect();
        for (name, item) in section(file, "rates", "rates", usize::MAX)? {
            if model.state(name).is_none() {
                let nearest = nearest(name, model.states.iter().map(|s| s.name.as_str()));
                check_name(&item, name)?;
                return Err(item.error(Fault::NoSuchState { state: name.into(), nearest }));
            }
        }
        for (index, (name, item)) in
            section(file, "states", "states", limits::MAX_STATES)?.into_iter().enumerate()
        {
            let Some(rate) = rates.get(name) else {
                let fault = Fault::NoRate { state: name.into() };
                return Err(item.reader.error(item.line, "states", fault));
            };
            let is_bare_value = item.value.get_ref().as_table().is_none();
            let start = if is_bare_value { Some(item.clone()) } else { item.entry("start") };
            model.states[index].start = match start {
                None => Expression { tree: Tree::number(0.0), line: item.line, key: item.key.clone() },
                Some(start) => match start.maybe_number() {
                    Some(value) => {
                        Expression { tree: Tree::number(value), line: start.line, key: start.key.clone() }
                    }
                    None => {
                        start.text("a number or an expression in quotes, such as \"position_m\"")?;
                        let read = self.expression(&start, Site::Start, false)?;
                        infer(model, &start, &read.tree)?;
                        read
                    }
                },
            };
            let expression = self.expression(rate, Site::Equation, false)?;
            let found = infer(model, rate, &expression.tree)?;
            let expected = model.states[index].unit.map(|unit| unit.dimensions() / Dimensions::TIME);
            if let (Some(found), Some(expected)) = (found, expected)
                && found != expected
            {
                let problem = Problem::RateUnit {
                    state: name.into(),
                    found: found.to_string(),
                    expected: expected.to_string(),
                };
                let text = expression.tree.text.clone();
                let span = 0..text.len();
                return Err(rate.reader.problem(rate.line, &rate.key, &text, (problem, span)));
            }
            model.states[index].rate = expression;
        }
        Ok(())
    }

    /// Reads the `[[events]]` blocks of a model file.
    fn events(&mut self, file: &Item<'_, '_>, model: &mut Model) -> Result<(), ModelError> {
        const DIRECTIONS: [(&str, Direction); 3] =
            [("rising", Direction::Rising), ("falling", Direction::Falling), ("both", Direction::Both)];
        let Some(events) = file.entry("events") else { return Ok(()) };
        let expected = "written as [[events]] blocks";
        let blocks = events.value.get_ref().as_array().ok_or_else(|| events.wrong(expected))?;
        if blocks.len() > limits::MAX_EVENTS {
            let fault = Fault::TooMany { what: "events", found: blocks.len(), allowed: limits::MAX_EVENTS };
            return Err(events.error(fault));
        }
        for (index, value) in blocks.iter().enumerate() {
            let line = file.reader.line(Value::span(value).start);
            let mut item = Item { reader: file.reader, key: format!("events.{}", index + 1), line, value };
            item.table(expected)?;
            let name = item.entry("name").map(|n| n.text("a name in quotes")).transpose()?;
            let name = name.map_or_else(|| format!("{}", index + 1), str::to_owned);
            let printable_name = escaped_short(&name);
            item.key = format!("events.{printable_name}");
            item.check_keys(&["name", "when", "direction", "set", "rest"])?;
            let missing = |key, example| item.error(Fault::Missing { key, example });
            let when = item.entry("when").ok_or_else(|| missing("when", "when = \"x_m - stop_m\""))?;
            let line = when.line;
            let when = self.expression(&when, Site::Equation, false)?;
            infer(model, &item, &when.tree)?;
            let direction = item.entry("direction").map_or(Ok(Direction::Both), |d| {
                d.word(&DIRECTIONS, "\"rising\", \"falling\" or \"both\"")
            })?;
            let set = item
                .entry("set")
                .ok_or_else(|| missing("set", "set = { v_m_s = \"-restitution * v_m_s\" }"))?;
            let mut assigned = Vec::new();
            for (state, value) in set.entries("a table such as { v_m_s = \"-restitution * v_m_s\" }")? {
                assigned.push((
                    state_named(model, &value, state)?,
                    self.expression(&value, Site::Equation, false)?,
                ));
                infer(model, &value, &assigned[assigned.len() - 1].1.tree)?;
            }
            let rest = item.entry("rest").map(|rest| self.rest(&rest, model)).transpose()?;
            model.events.push(Event { name: printable_name, when, direction, set: assigned, rest, line });
        }
        Ok(())
    }

    /// Reads the `rest` of an event: how a sequence of ever faster events ends.
    fn rest(&mut self, item: &Item<'_, '_>, model: &Model) -> Result<Rest, ModelError> {
        item.table("a table such as { below_m_s = 1e-3, hold = [\"x_m\"], until = \"force_N < 0\" }")?;
        let speed_limit = suffixed(item, "below");
        item.check_keys(&known_with(&["hold", "until"], &[&speed_limit]))?;
        let missing = || item.error(Fault::Missing { key: "below", example: "below_m_s = 1e-3" });
        let mut hold = Vec::new();
        if let Some(list) = item.entry("hold") {
            let expected = "a list of states, such as [\"x_m\"]";
            let states = list.value.get_ref().as_array().ok_or_else(|| list.wrong(expected))?;
            for state in states.iter() {
                let name = state.get_ref().as_str().ok_or_else(|| list.wrong(expected))?;
                hold.push(state_named(model, &list, name)?);
            }
        }
        let until = item.entry("until");
        let until = until.map(|until| self.expression(&until, Site::Equation, true)).transpose()?;
        if let Some(until) = &until {
            infer(model, item, &until.tree)?;
        }
        Ok(Rest { below: speed_limit.ok_or_else(missing)?.positive()?, hold, until })
    }

    /// Reads an expression; with `is_condition` the expression must be a comparison.
    fn expression(
        &mut self,
        item: &Item<'_, '_>,
        site: Site,
        is_condition: bool,
    ) -> Result<Expression, ModelError> {
        if let Some(value) = item.maybe_number() {
            return Ok(Expression { tree: Tree::number(value), line: item.line, key: item.key.clone() });
        }
        let text = item.text("an expression in quotes")?;
        let view = View { names: self.names, site, line: item.line };
        let wrong = |failure| item.reader.problem(item.line, &item.key, text, failure);
        let tree = text::parse(text, &view, is_condition).map_err(wrong)?;
        self.nodes += tree.nodes.len();
        if self.nodes > limits::MAX_FILE_NODES {
            return Err(wrong((Problem::TooManyNodes, 0..0)));
        }
        Ok(Expression { tree, line: item.line, key: item.key.clone() })
    }
}

/// Infers the dimensions of an expression, `None` if unknown; units that do not match are an error at `item`.
fn infer(model: &Model, item: &Item<'_, '_>, tree: &Tree) -> Result<Option<Dimensions>, ModelError> {
    let wrong = |failure| item.reader.problem(item.line, &item.key, &tree.text, failure);
    units::infer(model, tree).map_err(wrong)
}

/// Finds the index of the state with a name; an unknown name is an error at `item`.
fn state_named(model: &Model, item: &Item<'_, '_>, name: &str) -> Result<usize, ModelError> {
    model.state(name).ok_or_else(|| {
        let nearest = nearest(name, model.states.iter().map(|s| s.name.as_str()));
        item.error(Fault::NoSuchState { state: escaped_short(name), nearest })
    })
}

/// Reads the section `[numerics]` of a model file.
fn numerics(file: &Item<'_, '_>) -> Result<Numerics, ModelError> {
    const METHODS: [(&str, Integrator); 2] =
        [("explicit", Integrator::Explicit), ("implicit", Integrator::Implicit)];
    let Some(item) = file.entry("numerics") else { return Ok(Numerics::default()) };
    item.table("a table, such as [numerics]")?;
    item.check_keys(&["integrator", "substeps", "sign_width"])?;
    let integrator = item.entry("integrator");
    let integrator = integrator.map(|i| i.word(&METHODS, "\"explicit\" or \"implicit\"")).transpose()?;
    let substeps = item.entry("substeps").map(|found| {
        let whole = found.maybe_number().filter(|n| n.fract() == 0.0 && (1.0..=1024.0).contains(n));
        whole.map(|n| n as usize).ok_or_else(|| found.wrong("a whole number from 1 to 1024"))
    });
    let mut widths = BTreeMap::new();
    if let Some(table) = item.entry("sign_width") {
        for (text, width) in table.entries("a table such as { v_m_s = 0.01 }")? {
            widths.insert(text.to_owned(), width.positive()?);
        }
    }
    Ok(Numerics { integrator: integrator.unwrap_or_default(), substeps: substeps.transpose()?, widths })
}
