//! Reads a model file: every key is known or refused, every name is resolved, every mistake has its line.

use super::scope::{Names, Site, View};
use super::toml_reader::{Item, Reader, Value};
use super::{
    Direction, Event, Expression, Hold, Input, Integrator, Let, Model, Numerics, Output, Parameter, Rest,
    State, Table, check, units,
};
use crate::error::{Fault, ModelError};
use crate::limits;
use crate::nearest::nearest;
use crate::text::{self, Problem, Symbol, Tree};
use augsim_data::{Dimensions, Unit, shown, shown_cause};
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads a model file.
///
/// # Errors
/// The first mistake, with file, line, key and remedy.
pub fn read(path: &Path) -> Result<Model, ModelError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path);
    let text = text.map_err(|cause| {
        let fault = Fault::Unreadable { reason: cause.to_string() };
        Reader { file: &file, text: "" }.error(1, "", fault)
    })?;
    parse(&text, &file)
}

/// Reads the text of a model file; `file` is its name for messages.
///
/// # Errors
/// The first mistake, with file, line, key and remedy.
pub fn parse(text: &str, file: &str) -> Result<Model, ModelError> {
    let reader = Reader { file, text };
    if text.len() > limits::FILE_BYTES {
        return Err(reader.error(1, "", Fault::FileTooLong { bytes: text.len() }));
    }
    let root = DeTable::parse(text).map_err(|e| {
        let line = reader.line(e.span().map_or(0, |s| s.start));
        reader.error(line, "", Fault::Syntax { reason: shown_cause(&e.message()) })
    })?;
    let span = root.span();
    let root = Spanned::new(span, DeValue::Table(root.into_inner()));
    let file = Item { reader, key: String::new(), line: 1, value: &root };
    let mut names = Names::default();
    let mut model = Model {
        file: reader.file.into(),
        name: file.at("name").map_or(Ok("system"), |n| n.text("a name in quotes"))?.into(),
        states: Vec::new(),
        inputs: Vec::new(),
        parameters: Vec::new(),
        lets: Vec::new(),
        outputs: Vec::new(),
        events: Vec::new(),
        tables: Vec::new(),
        numerics: Numerics::default(),
    };
    declare(&file, &mut model, &mut names)?;
    Equations { names: &names, nodes: 0 }.read(&file, &mut model)?;
    check::check(&model, reader)?;
    Ok(model)
}

/// Keys that a model file may have at its top.
const TOP: [&str; 11] = [
    "scenario",
    "name",
    "states",
    "inputs",
    "parameters",
    "let",
    "rates",
    "outputs",
    "events",
    "tables",
    "numerics",
];

/// Reads all names with their numbers, so that expressions can be resolved wherever they stand.
fn declare(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    let constraint = ["constraints", "algebraic"].into_iter().find_map(|key| file.at(key));
    if let Some(found) = constraint {
        return Err(found.error(Fault::Constraint));
    }
    file.known(&TOP)?;
    let missing = |key, example| file.error(Fault::Missing { key, example });
    let scenario = file.at("scenario").ok_or_else(|| missing("scenario", "scenario = \"system\""))?;
    scenario.word(&[("system", ())], "\"system\" for a system of equations")?;
    for (key, example) in [
        ("states", "[states] with a line such as x_m = { start = \"position_m\" }"),
        ("rates", "[rates] with a line such as x_m = \"v_m_s\""),
        ("outputs", "[outputs] with a line such as position_m = { value = \"x_m\", sd = \"estimate\" }"),
    ] {
        let table = file.at(key).ok_or_else(|| missing(key, example))?;
        if table.entries("a table, such as [states]")?.is_empty() {
            return Err(table.error(Fault::Missing { key: "an entry", example }));
        }
    }
    declare_states(file, model, names)?;
    declare_inputs(file, model, names)?;
    declare_parameters(file, model, names)?;
    for (index, (name, item)) in
        section(file, "let", "values of [let]", limits::PARAMETERS)?.into_iter().enumerate()
    {
        claim(names, &item, name, Symbol::Let(index))?;
        names.let_lines.push(item.line);
    }
    for (name, item) in section(file, "outputs", "outputs", limits::OUTPUTS)? {
        check_name(&item, name)?;
        let text = item.value.get_ref().as_str().is_some();
        if !text {
            item.table("an expression in quotes or a table such as { value = \"x_m\", sd = \"estimate\" }")?;
        }
        let [range, step, period] = ["range", "step", "period"].map(|kind| suffixed(&item, kind));
        item.known(&known_with(&["value", "sd", "range", "unit"], &[&step, &period]))?;
        names.outputs.push(name.into());
        model.outputs.push(Output {
            name: name.into(),
            unit: unit(&item, name)?,
            value: nothing(&item),
            sd: match item.at("sd") {
                Some(sd) if sd.value.get_ref().as_str() == Some("estimate") => None,
                Some(sd) if sd.maybe_number().is_none() => {
                    return Err(sd.wrong("\"estimate\" or a positive number"));
                }
                sd => sd.map(|sd| sd.positive()).transpose()?,
            },
            range: range.map(|r| r.range()).transpose()?,
            step: step.map(|s| s.positive()).transpose()?,
            period: period.map(|p| p.positive()).transpose()?,
        });
    }
    declare_tables(file, model, names)
}

fn declare_states(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    for (index, (name, item)) in section(file, "states", "states", limits::STATES)?.into_iter().enumerate() {
        claim(names, &item, name, Symbol::State(index))?;
        item.known(&["start", "sd", "min", "max", "shared", "unit"])?;
        let [min, max] = ["min", "max"].map(|key| item.at(key).map(|bound| bound.number()).transpose());
        let (min, max) = (min?, max?);
        if let (Some(min), Some(max)) = (min, max)
            && min >= max
        {
            return Err(item.error(Fault::EmptyBounds { min, max }));
        }
        model.states.push(State {
            name: name.into(),
            unit: unit(&item, name)?,
            start: nothing(&item),
            sd: item.at("sd").map(|sd| sd.positive()).transpose()?,
            min,
            max,
            shared: item.at("shared").map_or(Ok(false), |shared| shared.flag())?,
            rate: nothing(&item),
            line: item.line,
        });
    }
    Ok(())
}

fn declare_inputs(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    const HOLDS: [(&str, Hold); 3] =
        [("zero", Hold::Zero), ("linear", Hold::Linear), ("spline", Hold::Spline)];
    for (index, (name, item)) in section(file, "inputs", "inputs", limits::INPUTS)?.into_iter().enumerate() {
        claim(names, &item, name, Symbol::Input(index))?;
        // A bare word is its hold: force_N = "zero".
        let bare = item.value.get_ref().as_str().is_some();
        let hold = if bare { Some(item.clone()) } else { item.at("hold") };
        if !bare {
            item.table("a table such as { hold = \"zero\" }")?;
        }
        item.known(&["hold", "delay_s", "unit"])?;
        model.inputs.push(Input {
            name: name.into(),
            unit: unit(&item, name)?,
            hold: hold.map(|h| h.word(&HOLDS, "\"zero\", \"linear\" or \"spline\"")).transpose()?,
            delay: None,
        });
    }
    Ok(())
}

fn declare_parameters(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    let parameters = section(file, "parameters", "parameters", limits::PARAMETERS)?;
    for (index, (name, item)) in parameters.into_iter().enumerate() {
        claim(names, &item, name, Symbol::Parameter(index))?;
        model.parameters.push(parameter(&item, name)?);
    }
    for (index, (name, item)) in section(file, "inputs", "inputs", limits::INPUTS)?.into_iter().enumerate() {
        if let Some(delay) = item.at("delay_s") {
            let mut p = parameter(&delay, &format!("{name}.delay_s"))?;
            p.unit = Some(Unit::SECOND);
            p.frozen |= delay.maybe_number().is_some();
            p.min = p.min.max(0.0);
            if p.nominal < 0.0 {
                return Err(delay.error(Fault::OutsideBounds { nominal: p.nominal, min: p.min, max: p.max }));
            }
            model.inputs[index].delay = Some(model.parameters.len());
            model.parameters.push(p);
        }
    }
    Ok(())
}

fn parameter(item: &Item<'_, '_>, name: &str) -> Result<Parameter, ModelError> {
    let expected = "a number or a table such as { nominal = 1.0, min = 0.0, max = 10.0 }";
    let nominal = match item.maybe_number() {
        Some(value) => value,
        None => {
            item.table(expected)?;
            item.known(&["nominal", "min", "max", "frozen", "unit", "ci95"])?;
            let missing = || item.error(Fault::Missing { key: "nominal", example: "nominal = 1.0" });
            item.at("nominal").ok_or_else(missing)?.number()?
        }
    };
    let bound = |key, default| item.at(key).map_or(Ok(default), |bound| bound.number());
    let (min, max) = (bound("min", f64::NEG_INFINITY)?, bound("max", f64::INFINITY)?);
    if min >= max {
        return Err(item.error(Fault::EmptyBounds { min, max }));
    }
    if !(min..=max).contains(&nominal) {
        return Err(item.error(Fault::OutsideBounds { nominal, min, max }));
    }
    Ok(Parameter {
        name: name.into(),
        unit: unit(item, name)?,
        nominal,
        min,
        max,
        frozen: item.at("frozen").map_or(Ok(false), |frozen| frozen.flag())?,
        ci95: item.at("ci95").map(|ci| ci.range()).transpose()?,
        line: item.line,
    })
}

fn declare_tables(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    for (name, item) in section(file, "tables", "tables", limits::TABLES)? {
        check_name(&item, name)?;
        item.table("a table such as [tables.curve] with at = [0.0, 1.0] and values = [0.0, 2.0]")?;
        item.known(&["at", "values", "unit"])?;
        let list = |key, example| {
            let list = item.at(key).ok_or_else(|| item.error(Fault::Missing { key, example }))?;
            list.numbers("a list of numbers")
        };
        let (at, values) = (list("at", "at = [0.0, 1.0]")?, list("values", "values = [0.0, 2.0]")?);
        if at.len() != values.len() || at.len() < 2 {
            return Err(item.error(Fault::KnotsUnequal { at: at.len(), values: values.len() }));
        }
        if at.len() > limits::KNOTS {
            let fault = Fault::TooMany { of: "knots", found: at.len(), allowed: limits::KNOTS };
            return Err(item.error(fault));
        }
        if let Some(pair) = at.windows(2).find(|pair| pair[1] <= pair[0]) {
            return Err(item.error(Fault::KnotsDoNotRise { left: pair[0], right: pair[1] }));
        }
        names.tables.push(name.into());
        let unit = item.at("unit");
        let unit = unit.map(|unit| unit_of(&unit)).transpose()?;
        model.tables.push(Table { name: name.into(), at, values, unit });
    }
    Ok(())
}

/// Entries of a table at the top; none where it is absent.
fn section<'r, 't>(
    file: &Item<'r, 't>,
    key: &str,
    of: &'static str,
    allowed: usize,
) -> Result<Vec<(&'r str, Item<'r, 't>)>, ModelError> {
    let Some(table) = file.at(key) else { return Ok(Vec::new()) };
    let entries = table.entries("a table, such as [states]")?;
    if entries.len() > allowed {
        return Err(table.error(Fault::TooMany { of, found: entries.len(), allowed }));
    }
    Ok(entries)
}

fn check_name(item: &Item<'_, '_>, name: &str) -> Result<(), ModelError> {
    let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if !begins || name.len() > 64 || !name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_') {
        return Err(item.error(Fault::MalformedName { name: shown(name) }));
    }
    if text::is_reserved(name) {
        return Err(item.error(Fault::ReservedName { name: name.into() }));
    }
    Ok(())
}

fn claim(names: &mut Names, item: &Item<'_, '_>, name: &str, symbol: Symbol) -> Result<(), ModelError> {
    check_name(item, name)?;
    if let Some((_, other)) = names.quantities.iter().find(|(n, _)| n == name) {
        let other = match other {
            Symbol::State(_) => "a state",
            Symbol::Input(_) => "an input",
            Symbol::Parameter(_) => "a parameter",
            _ => "a value of [let]",
        };
        return Err(item.error(Fault::NameTwice { name: name.into(), other }));
    }
    names.quantities.push((name.into(), symbol));
    Ok(())
}

/// Unit by `unit`, or else by the name.
fn unit(item: &Item<'_, '_>, name: &str) -> Result<Option<Unit>, ModelError> {
    match item.at("unit") {
        Some(unit) => unit_of(&unit).map(Some),
        None => Ok(Unit::of_column_name(name)),
    }
}

fn unit_of(unit: &Item<'_, '_>) -> Result<Unit, ModelError> {
    let text = unit.text("a unit in quotes, such as \"N/m\"")?;
    Unit::of_text(text).ok_or_else(|| unit.error(Fault::UnknownUnit { text: shown(text) }))
}

/// The entry `kind` or `kind_UNIT`.
fn suffixed<'r, 't>(item: &Item<'r, 't>, kind: &str) -> Option<Item<'r, 't>> {
    let entries = item.value.get_ref().as_table().map(|table| item.reader.entries(table))?;
    let is =
        |name: &str| name.strip_prefix(kind).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
    let (name, ..) = entries.into_iter().find(|(name, ..)| is(name))?;
    item.at(name)
}

/// Known keys with those that were found under a name with a unit.
fn known_with<'k>(known: &[&'k str], found: &'k [&Option<Item<'_, '_>>]) -> Vec<&'k str> {
    let suffixed = found.iter().filter_map(|item| item.as_ref()?.key.rsplit('.').next());
    known.iter().copied().chain(suffixed).collect()
}

/// Stands where an expression will be read in the second pass.
fn nothing(item: &Item<'_, '_>) -> Expression {
    let tree = Tree { text: String::new(), nodes: Vec::new() };
    Expression { tree, line: item.line, key: item.key.clone() }
}

/// The second pass: expressions, in which all names are known.
struct Equations<'n> {
    names: &'n Names,
    /// Nodes of all expressions so far.
    nodes: usize,
}

impl Equations<'_> {
    fn read(mut self, file: &Item<'_, '_>, model: &mut Model) -> Result<(), ModelError> {
        for (index, (name, item)) in
            section(file, "let", "values", limits::PARAMETERS)?.into_iter().enumerate()
        {
            let value = self.expression(&item, Site::Let(index), false)?;
            let of_name = || Unit::of_column_name(name).map(Unit::dimensions);
            let dimensions = infer(model, &item, &value.tree)?.or_else(of_name);
            model.lets.push(Let { name: name.into(), dimensions, value });
        }
        self.states(file, model)?;
        for (index, (_, item)) in
            section(file, "outputs", "outputs", limits::OUTPUTS)?.into_iter().enumerate()
        {
            let value = match item.value.get_ref().as_str() {
                Some(_) => self.expression(&item, Site::Equation, false)?,
                None => {
                    let example = "value = \"x_m\"";
                    let missing = || item.error(Fault::Missing { key: "value", example });
                    let mut value = item.at("value").ok_or_else(missing)?;
                    value.key.clone_from(&item.key);
                    self.expression(&value, Site::Equation, false)?
                }
            };
            infer(model, &item, &value.tree)?;
            model.outputs[index].value = value;
        }
        self.events(file, model)?;
        model.numerics = numerics(file)?;
        Ok(())
    }

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
            section(file, "states", "states", limits::STATES)?.into_iter().enumerate()
        {
            let Some(rate) = rates.get(name) else {
                let fault = Fault::NoRate { state: name.into() };
                return Err(item.reader.error(item.line, "states", fault));
            };
            let bare = item.value.get_ref().as_table().is_none();
            let start = if bare { Some(item.clone()) } else { item.at("start") };
            model.states[index].start = match start {
                None => Expression { tree: number(0.0), line: item.line, key: item.key.clone() },
                Some(start) => match start.maybe_number() {
                    Some(value) => {
                        Expression { tree: number(value), line: start.line, key: start.key.clone() }
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

    fn events(&mut self, file: &Item<'_, '_>, model: &mut Model) -> Result<(), ModelError> {
        const DIRECTIONS: [(&str, Direction); 3] =
            [("rising", Direction::Rising), ("falling", Direction::Falling), ("both", Direction::Both)];
        let Some(events) = file.at("events") else { return Ok(()) };
        let expected = "written as [[events]] blocks";
        let blocks = events.value.get_ref().as_array().ok_or_else(|| events.wrong(expected))?;
        if blocks.len() > limits::EVENTS {
            let fault = Fault::TooMany { of: "events", found: blocks.len(), allowed: limits::EVENTS };
            return Err(events.error(fault));
        }
        for (index, value) in blocks.iter().enumerate() {
            let line = file.reader.line(Value::span(value).start);
            let mut item = Item { reader: file.reader, key: format!("events.{}", index + 1), line, value };
            item.table(expected)?;
            let name = item.at("name").map(|n| n.text("a name in quotes")).transpose()?;
            let name = name.map_or_else(|| format!("{}", index + 1), str::to_owned);
            let plain = shown(&name);
            item.key = format!("events.{plain}");
            item.known(&["name", "when", "direction", "set", "rest"])?;
            let missing = |key, example| item.error(Fault::Missing { key, example });
            let when = item.at("when").ok_or_else(|| missing("when", "when = \"x_m - stop_m\""))?;
            let line = when.line;
            let when = self.expression(&when, Site::Equation, false)?;
            infer(model, &item, &when.tree)?;
            let direction = item.at("direction").map_or(Ok(Direction::Both), |d| {
                d.word(&DIRECTIONS, "\"rising\", \"falling\" or \"both\"")
            })?;
            let set =
                item.at("set").ok_or_else(|| missing("set", "set = { v_m_s = \"-restitution * v_m_s\" }"))?;
            let mut assigned = Vec::new();
            for (state, value) in set.entries("a table such as { v_m_s = \"-restitution * v_m_s\" }")? {
                assigned.push((
                    state_named(model, &value, state)?,
                    self.expression(&value, Site::Equation, false)?,
                ));
                infer(model, &value, &assigned[assigned.len() - 1].1.tree)?;
            }
            let rest = item.at("rest").map(|rest| self.rest(&rest, model)).transpose()?;
            model.events.push(Event { name: plain, when, direction, set: assigned, rest, line });
        }
        Ok(())
    }

    fn rest(&mut self, item: &Item<'_, '_>, model: &Model) -> Result<Rest, ModelError> {
        item.table("a table such as { below_m_s = 1e-3, hold = [\"x_m\"], until = \"force_N < 0\" }")?;
        let below = suffixed(item, "below");
        item.known(&known_with(&["hold", "until"], &[&below]))?;
        let missing = || item.error(Fault::Missing { key: "below", example: "below_m_s = 1e-3" });
        let mut hold = Vec::new();
        if let Some(list) = item.at("hold") {
            let expected = "a list of states, such as [\"x_m\"]";
            let states = list.value.get_ref().as_array().ok_or_else(|| list.wrong(expected))?;
            for state in states.iter() {
                let name = state.get_ref().as_str().ok_or_else(|| list.wrong(expected))?;
                hold.push(state_named(model, &list, name)?);
            }
        }
        let until = item.at("until");
        let until = until.map(|until| self.expression(&until, Site::Equation, true)).transpose()?;
        if let Some(until) = &until {
            infer(model, item, &until.tree)?;
        }
        Ok(Rest { below: below.ok_or_else(missing)?.positive()?, hold, until })
    }

    fn expression(
        &mut self,
        item: &Item<'_, '_>,
        site: Site,
        conditional: bool,
    ) -> Result<Expression, ModelError> {
        if let Some(value) = item.maybe_number() {
            return Ok(Expression { tree: number(value), line: item.line, key: item.key.clone() });
        }
        let text = item.text("an expression in quotes")?;
        let view = View { names: self.names, site, line: item.line };
        let wrong = |failure| item.reader.problem(item.line, &item.key, text, failure);
        let tree = text::parse(text, &view, conditional).map_err(wrong)?;
        self.nodes += tree.nodes.len();
        if self.nodes > limits::FILE_NODES {
            return Err(wrong((Problem::TooManyNodes, 0..0)));
        }
        Ok(Expression { tree, line: item.line, key: item.key.clone() })
    }
}

/// A tree of one number.
fn number(value: f64) -> Tree {
    let node = text::TreeNode { kind: text::Kind::Number(value), span: 0..0 };
    Tree { text: format!("{value}"), nodes: vec![node] }
}

fn infer(model: &Model, item: &Item<'_, '_>, tree: &Tree) -> Result<Option<Dimensions>, ModelError> {
    let wrong = |failure| item.reader.problem(item.line, &item.key, &tree.text, failure);
    units::infer(model, tree).map_err(wrong)
}

fn state_named(model: &Model, item: &Item<'_, '_>, name: &str) -> Result<usize, ModelError> {
    model.state(name).ok_or_else(|| {
        let nearest = nearest(name, model.states.iter().map(|s| s.name.as_str()));
        item.error(Fault::NoSuchState { state: shown(name), nearest })
    })
}

fn numerics(file: &Item<'_, '_>) -> Result<Numerics, ModelError> {
    const METHODS: [(&str, Integrator); 2] =
        [("explicit", Integrator::Explicit), ("implicit", Integrator::Implicit)];
    let Some(item) = file.at("numerics") else { return Ok(Numerics::default()) };
    item.table("a table, such as [numerics]")?;
    item.known(&["integrator", "substeps", "sign_width"])?;
    let integrator = item.at("integrator");
    let integrator = integrator.map(|i| i.word(&METHODS, "\"explicit\" or \"implicit\"")).transpose()?;
    let substeps = item.at("substeps").map(|found| {
        let whole = found.maybe_number().filter(|n| n.fract() == 0.0 && (1.0..=1024.0).contains(n));
        whole.map(|n| n as usize).ok_or_else(|| found.wrong("a whole number from 1 to 1024"))
    });
    let mut widths = BTreeMap::new();
    if let Some(table) = item.at("sign_width") {
        for (text, width) in table.entries("a table such as { v_m_s = 0.01 }")? {
            widths.insert(text.to_owned(), width.positive()?);
        }
    }
    Ok(Numerics { integrator: integrator.unwrap_or_default(), substeps: substeps.transpose()?, widths })
}
