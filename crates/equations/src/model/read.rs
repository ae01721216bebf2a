//! Reads a model file; unknown keys and names are errors, and each error has its line.

use super::entries::{check_name, known_with, section, suffixed};
use super::equations::Equations;
use super::quantity::{parameter, unit, unit_of};
use super::scope::Names;
use super::toml_reader::{Item, Reader};
use super::{
    Expression, Hold, Input, Model, Numerics, Output, RateNoise, SensorNoise, State, Table, check,
    covariance, effects,
};
use crate::error::{Fault, ModelError, ReadFault};
use crate::limits;
use crate::text::{Symbol, Tree};
use augsim_data::Unit;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads a model file.
///
/// # Errors
/// The first error, with file, line, key and what to do.
pub fn read(path: &Path) -> Result<Model, ModelError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path);
    let text = text.map_err(|cause| {
        let fault = Fault::Unreadable { cause: ReadFault(Arc::new(cause)) };
        Reader { file: &file, text: "" }.error(1, "", fault)
    })?;
    parse(&text, &file)
}

/// Parses the text of a model file; `file` is its name in messages.
///
/// # Errors
/// The first error, with file, line, key and what to do.
pub fn parse(text: &str, file: &str) -> Result<Model, ModelError> {
    let reader = Reader { file, text };
    if text.len() > limits::MAX_FILE_BYTES {
        return Err(reader.error(1, "", Fault::FileTooLong { bytes: text.len() }));
    }
    let root = DeTable::parse(text).map_err(|e| {
        let line = reader.line(e.span().map_or(0, |s| s.start));
        reader.error(line, "", Fault::Syntax { cause: e })
    })?;
    let span = root.span();
    let root = Spanned::new(span, DeValue::Table(root.into_inner()));
    let file = Item { reader, key: String::new(), line: 1, value: &root };
    let mut names = Names::default();
    let mut model = Model {
        file: reader.file.into(),
        name: file.entry("name").map_or(Ok("system"), |n| n.text("a name in quotes"))?.into(),
        states: Vec::new(),
        inputs: Vec::new(),
        parameters: Vec::new(),
        lets: Vec::new(),
        outputs: Vec::new(),
        events: Vec::new(),
        tables: Vec::new(),
        numerics: Numerics::default(),
        robot: None,
        external: None,
        additions: Vec::new(),
        covariance: None,
        candidates: Vec::new(),
        text: text.into(),
    };
    let robot = super::robot::declare(&file)?;
    names.joints.extend(robot.iter().flat_map(|robot| robot.joints.clone()));
    declare(&file, &mut model, &mut names)?;
    model.external = super::external::read(&file, &model)?;
    Equations::new(&names).read(&file, robot, &mut model)?;
    effects::read(&file, &mut model)?;
    model.covariance = covariance::read(&file, &model)?;
    check::check(&model, reader)?;
    Ok(model)
}

/// Keys that a model file may have at its top level.
const TOP_LEVEL_KEYS: [&str; 16] = [
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
    "robot",
    "external",
    "numerics",
    "effect",
    "candidate",
    "covariance",
];

/// Reads the names of all quantities with their numbers, in a first pass over the file.
///
/// Expressions are read later, so they may use a quantity that is declared after them.
fn declare(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    let constraint = ["constraints", "algebraic"].into_iter().find_map(|key| file.entry(key));
    if let Some(found) = constraint {
        return Err(found.error(Fault::Constraint));
    }
    file.check_keys(&TOP_LEVEL_KEYS)?;
    let missing = |key, example| file.error(Fault::Missing { key, example });
    let scenario = file.entry("scenario").ok_or_else(|| missing("scenario", "scenario = \"system\""))?;
    scenario.word(&[("system", ())], "\"system\" for a system of equations")?;
    // The inverse dynamics of a robot need no states: the measured motion is an input.
    let is_static =
        !names.joints.is_empty() && file.entry("states").is_none() && file.entry("rates").is_none();
    for (key, example) in [
        ("states", "[states] with a line such as x_m = { start = \"position_m\" }"),
        ("rates", "[rates] with a line such as x_m = \"v_m_s\""),
        ("outputs", "[outputs] with a line such as position_m = { value = \"x_m\", sd = \"estimate\" }"),
    ] {
        if is_static && key != "outputs" {
            continue;
        }
        let table = file.entry(key).ok_or_else(|| missing(key, example))?;
        if table.entries("a table, such as [states]")?.is_empty() {
            return Err(table.error(Fault::EmptyTable { example }));
        }
    }
    declare_states(file, model, names)?;
    declare_inputs(file, model, names)?;
    declare_parameters(file, model, names)?;
    for (index, (name, item)) in
        section(file, "let", "values of [let]", limits::MAX_PARAMETERS)?.into_iter().enumerate()
    {
        declare_name(names, &item, name, Symbol::Let(index))?;
        names.let_lines.push(item.line);
    }
    for (name, item) in section(file, "outputs", "outputs", limits::MAX_OUTPUTS)? {
        check_name(&item, name)?;
        let is_text = item.value.get_ref().as_str().is_some();
        if !is_text {
            item.table("an expression in quotes or a table such as { value = \"x_m\", sd = \"estimate\" }")?;
        }
        let [range, step, period] = ["range", "step", "period"].map(|kind| suffixed(&item, kind));
        item.check_keys(&known_with(
            &["value", "sd", "noise", "range", "unit", "low_pass_hz"],
            &[&step, &period],
        ))?;
        names.outputs.push(name.into());
        model.outputs.push(Output {
            name: name.into(),
            unit: unit(&item, name)?,
            value: placeholder(&item),
            sd: match item.entry("sd") {
                Some(sd) if sd.value.get_ref().as_str() == Some("estimate") => None,
                Some(sd) if sd.maybe_number().is_none() => {
                    return Err(sd.wrong("\"estimate\" or a positive number"));
                }
                sd => sd.map(|sd| sd.positive()).transpose()?,
            },
            noise: item.entry("noise").map(|noise| read_noise(&noise)).transpose()?,
            range: range.map(|r| r.range()).transpose()?,
            step: step.map(|s| s.positive()).transpose()?,
            period: period.map(|p| p.positive()).transpose()?,
            low_pass_hz: item.entry("low_pass_hz").map(|cutoff| cutoff.positive()).transpose()?,
        });
    }
    declare_tables(file, model, names)
}

/// Reads the section `[states]` except for the expressions.
fn declare_states(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    for (index, (name, item)) in
        section(file, "states", "states", limits::MAX_STATES)?.into_iter().enumerate()
    {
        declare_name(names, &item, name, Symbol::State(index))?;
        item.check_keys(&["start", "sd", "min", "max", "shared", "shaken", "unit"])?;
        let [min, max] = ["min", "max"].map(|key| item.entry(key).map(|bound| bound.number()).transpose());
        let (min, max) = (min?, max?);
        if let (Some(min), Some(max)) = (min, max)
            && min >= max
        {
            return Err(item.error(Fault::EmptyBounds { min, max }));
        }
        model.states.push(State {
            name: name.into(),
            unit: unit(&item, name)?,
            start: placeholder(&item),
            sd: item.entry("sd").map(|sd| sd.positive()).transpose()?,
            min,
            max,
            shared: item.entry("shared").map_or(Ok(false), |shared| shared.flag())?,
            process_noise: item.entry("shaken").map(|shaken| read_process_noise(&shaken)).transpose()?,
            rate: placeholder(&item),
            line: item.line,
        });
    }
    Ok(())
}

/// Reads the measurement noise that a fit has written for an output.
fn read_noise(item: &Item<'_, '_>) -> Result<SensorNoise, ModelError> {
    let example = "noise = { white_sd = 0.1, autocorrelated_sd = 0.05, correlation_time_s = 0.3 }";
    item.table("a table such as { white_sd = 0.1, autocorrelated_sd = 0.05, correlation_time_s = 0.3 }")?;
    item.check_keys(&["white_sd", "autocorrelated_sd", "correlation_time_s"])?;
    let entry = |key| -> Result<f64, ModelError> {
        let value = item.entry(key).ok_or_else(|| item.error(Fault::Missing { key, example }))?;
        let found = value.number()?;
        if found < 0.0 { Err(value.error(Fault::Negative { found })) } else { Ok(found) }
    };
    Ok(SensorNoise {
        white_sd: entry("white_sd")?,
        autocorrelated_sd: entry("autocorrelated_sd")?,
        correlation_time_s: entry("correlation_time_s")?,
    })
}

/// Reads the process noise of a state.
fn read_process_noise(item: &Item<'_, '_>) -> Result<RateNoise, ModelError> {
    let example = "shaken = { sd = 0.1, memory_s = 0.02 }";
    item.table("a table such as { sd = 0.1, memory_s = 0.02 }")?;
    item.check_keys(&["sd", "memory_s"])?;
    let entry = |key| item.entry(key).ok_or_else(|| item.error(Fault::Missing { key, example }));
    let memory = entry("memory_s")?;
    let memory_s = memory.number()?;
    if memory_s < 0.0 {
        return Err(memory.error(Fault::Negative { found: memory_s }));
    }
    Ok(RateNoise { sd: entry("sd")?.positive()?, correlation_time_s: memory_s })
}

/// Reads the section `[inputs]` except for the delays.
fn declare_inputs(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    const HOLDS: [(&str, Hold); 3] =
        [("zero", Hold::Zero), ("linear", Hold::Linear), ("spline", Hold::Spline)];
    for (index, (name, item)) in
        section(file, "inputs", "inputs", limits::MAX_INPUTS)?.into_iter().enumerate()
    {
        declare_name(names, &item, name, Symbol::Input(index))?;
        // A plain string is the interpolation: force_N = "zero".
        let is_plain_text = item.value.get_ref().as_str().is_some();
        let hold = if is_plain_text { Some(item.clone()) } else { item.entry("hold") };
        if !is_plain_text {
            item.table("a table such as { hold = \"zero\" }")?;
        }
        item.check_keys(&["hold", "delay_s", "unit"])?;
        model.inputs.push(Input {
            name: name.into(),
            unit: unit(&item, name)?,
            hold: hold.map(|h| h.word(&HOLDS, "\"zero\", \"linear\" or \"spline\"")).transpose()?,
            delay: None,
        });
    }
    Ok(())
}

/// Reads the section `[parameters]`, then the delays of inputs, which are parameters as well.
fn declare_parameters(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    let parameters = section(file, "parameters", "parameters", limits::MAX_PARAMETERS)?;
    for (index, (name, item)) in parameters.into_iter().enumerate() {
        declare_name(names, &item, name, Symbol::Parameter(index))?;
        model.parameters.push(parameter(&item, name)?);
    }
    for (index, (name, item)) in
        section(file, "inputs", "inputs", limits::MAX_INPUTS)?.into_iter().enumerate()
    {
        if let Some(delay) = item.entry("delay_s") {
            let mut p = parameter(&delay, &format!("{name}.delay_s"))?;
            p.unit = Some(Unit::SECOND);
            p.frozen |= delay.maybe_number().is_some();
            p.min = p.min.max(0.0);
            if p.nominal < 0.0 {
                return Err(delay.error(Fault::OutsideBounds { value: p.nominal, min: p.min, max: p.max }));
            }
            model.inputs[index].delay = Some(model.parameters.len());
            model.parameters.push(p);
        }
    }
    Ok(())
}

/// Reads the section `[tables]`.
fn declare_tables(file: &Item<'_, '_>, model: &mut Model, names: &mut Names) -> Result<(), ModelError> {
    for (name, item) in section(file, "tables", "tables", limits::MAX_TABLES)? {
        check_name(&item, name)?;
        item.table("a table such as [tables.curve] with at = [0.0, 1.0] and values = [0.0, 2.0]")?;
        item.check_keys(&["at", "values", "unit"])?;
        let list = |key, example| {
            let list = item.entry(key).ok_or_else(|| item.error(Fault::Missing { key, example }))?;
            list.numbers("a list of numbers")
        };
        let (at, values) = (list("at", "at = [0.0, 1.0]")?, list("values", "values = [0.0, 2.0]")?);
        if at.len() != values.len() || at.len() < 2 {
            return Err(item.error(Fault::KnotsUnequal { at: at.len(), values: values.len() }));
        }
        if at.len() > limits::MAX_KNOTS {
            let fault = Fault::TooMany { what: "knots", found: at.len(), allowed: limits::MAX_KNOTS };
            return Err(item.error(fault));
        }
        if let Some(pair) = at.windows(2).find(|pair| pair[1] <= pair[0]) {
            return Err(item.error(Fault::KnotsDoNotRise { left: pair[0], right: pair[1] }));
        }
        names.tables.push(name.into());
        let unit = item.entry("unit");
        let unit = unit.map(|unit| unit_of(&unit)).transpose()?;
        model.tables.push(Table { name: name.into(), at, values, unit });
    }
    Ok(())
}

/// Adds a name to the declared ones, unless it is malformed, reserved or used already.
fn declare_name(
    names: &mut Names,
    item: &Item<'_, '_>,
    name: &str,
    symbol: Symbol,
) -> Result<(), ModelError> {
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

/// Creates a placeholder for an expression that the second pass will read.
fn placeholder(item: &Item<'_, '_>) -> Expression {
    let tree = Tree { text: String::new(), nodes: Vec::new() };
    Expression { tree, line: item.line, key: item.key.clone() }
}
