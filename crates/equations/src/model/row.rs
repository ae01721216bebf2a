//! Reads the description of a kind of effect: expression, places where it is tried, and parameters.

use super::entries::check_name;
use super::quantity::unit;
use super::toml_reader::{Item, Reader};
use super::{DraftState, How};
use crate::error::{Fault, ModelError};
use augsim_data::{Unit, escaped_short};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A kind of effect, as a `[[candidate]]` block describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the kind of effect.
    pub kind: String,
    /// General places where the effect is tried, such as `force`, or names of quantities of the model.
    pub on: Vec<String>,
    /// How the effect's expression changes its target.
    pub how: How,
    /// Text of the effect's expression, in names of the row and of the model.
    pub expression: String,
    /// Expressions that the effect adds to the further targets of its place, such as the second equation of a pair.
    pub others: Vec<String>,
    /// States that belong to the effect.
    pub states: Vec<DraftState>,
    /// Parameters of the effect.
    pub parameters: Vec<RowParameter>,
    /// Other physical explanations that the effect may be mistaken for.
    pub equivalent_causes: Vec<String>,
    /// Kinds of effects that describe the same phenomenon and are not added together with this one.
    pub excludes: Vec<String>,
    /// Kind of the simpler effect that results when the inner parameters go to their bounds; `None` if there is none.
    pub reduces_to: Option<String>,
    /// Experiments that distinguish the effect from others: kind of the other effect, and what to do.
    pub separated_by: Vec<(String, String)>,
    /// Literature reference or other origin of the formula.
    pub source: String,
    /// File name and line of the block that describes the effect.
    pub place: (String, usize),
}

/// A parameter of a kind of effect. With `of`, its numbers are multiples of the size of that quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct RowParameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter; `None` if neither `unit` nor the name states one.
    pub unit: Option<Unit>,
    /// Quantity whose size the numbers of this parameter are multiples of; `None` if they are in its unit.
    pub of: Option<String>,
    /// Size in the data that `min` and the grid are raised to, because smaller values have no effect on the data.
    pub least: Option<String>,
    /// Whether a fit keeps the parameter at its initial value.
    pub frozen: bool,
    /// Smallest allowed value; minus infinity if the block states none.
    pub min: f64,
    /// Largest allowed value; infinity if the block states none.
    pub max: f64,
    /// Value at which the effect vanishes; `None` for an inner parameter, such as a width, which has no such value.
    pub null: Option<f64>,
    /// A typical value of the parameter; `None` if the block states none.
    pub typical: Option<f64>,
    /// Values of an inner parameter from which fits start.
    pub grid: Vec<f64>,
    /// Values of a threshold parameter from which scans start.
    pub scan: Vec<f64>,
    /// Whether the parameter is a period or a frequency of the effect, whose values are searched densely.
    pub cycle: Option<Cycle>,
}

/// How a parameter of a periodic effect determines its cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cycle {
    /// The parameter is the length of a cycle.
    Period,
    /// The parameter is the number of cycles, or its angle, per unit.
    Frequency,
}

/// Keys of a `[[candidate]]` block that are not parameters.
const RESERVED_KEYS: [&str; 12] = [
    "kind",
    "on",
    "add",
    "factor",
    "replace",
    "add_other",
    "states",
    "stands_for",
    "excludes",
    "contains",
    "separated_by",
    "source",
];

/// Reads all rows of a text that consists of `[[candidate]]` blocks.
pub(crate) fn read_all(text: &str, file: &str) -> Result<Vec<Row>, ModelError> {
    let reader = Reader { file, text };
    let root = DeTable::parse(text).map_err(|e| {
        let line = reader.line(e.span().map_or(0, |s| s.start));
        reader.error(line, "", Fault::Syntax { cause: e })
    })?;
    let span = root.span();
    let root = Spanned::new(span, DeValue::Table(root.into_inner()));
    let file = Item { reader, key: String::new(), line: 1, value: &root };
    file.check_keys(&["candidate"])?;
    file.blocks("candidate", "written as [[candidate]] blocks")?.iter().map(Row::read).collect()
}

impl Row {
    /// Reads a kind of effect from a `[[candidate]]` block.
    ///
    /// # Errors
    /// A key that is missing or has a value of the wrong form.
    pub(crate) fn read(item: &Item<'_, '_>) -> Result<Row, ModelError> {
        let missing = |key, example| item.error(Fault::Missing { key, example });
        let texts = |key: &'static str| -> Result<Vec<String>, ModelError> {
            let Some(list) = item.entry(key) else { return Ok(Vec::new()) };
            match list.value.get_ref().as_str() {
                Some(word) => Ok(vec![word.to_owned()]),
                None => list.texts("a text in quotes, or a list of them"),
            }
        };
        let kind = item.entry("kind").ok_or_else(|| missing("kind", "kind = \"my-effect\""))?;
        let kind = escaped_short(kind.text("a name in quotes")?);
        let on = texts("on")?;
        if on.is_empty() {
            return Err(missing("on", "on = \"omega_rad_s\", the rate, output or input that it changes"));
        }
        let (how, expression) = change(item)?;
        let mut parameters = Vec::new();
        for (name, entry) in item.entries("written as [[candidate]] blocks")? {
            if !RESERVED_KEYS.contains(&name) {
                check_name(&entry, name)?;
                parameters.push(RowParameter::read(name, &entry)?);
            }
        }
        let contains =
            item.entry("contains").map(|c| c.text("a kind in quotes").map(escaped_short)).transpose()?;
        let source =
            item.entry("source").map(|s| s.text("a text in quotes").map(escaped_short)).transpose()?;
        Ok(Row {
            kind,
            on,
            how,
            expression,
            others: texts("add_other")?,
            states: states(item)?,
            parameters,
            equivalent_causes: texts("stands_for")?,
            excludes: texts("excludes")?,
            reduces_to: contains,
            separated_by: separated_by(item)?,
            source: source.unwrap_or_default(),
            place: (item.reader.file.to_owned(), item.line),
        })
    }
}

/// Reads the states of an effect's block.
fn states(item: &Item<'_, '_>) -> Result<Vec<DraftState>, ModelError> {
    let mut states = Vec::new();
    if let Some(table) = item.entry("states") {
        let example = "a table such as { z = { rate = \"v - abs(v) * z / d\", start = 0.0 } }";
        for (name, state) in table.entries(example)? {
            check_name(&state, name)?;
            state.table(example)?;
            state.check_keys(&["rate", "start", "spread"])?;
            let missing_rate =
                || state.error(Fault::Missing { key: "rate", example: "rate = \"v - z / d\"" });
            let rate = state.entry("rate").ok_or_else(missing_rate)?;
            let start = state.entry("start").map_or(Ok("0".to_owned()), |start| start.number_or_text())?;
            let rate = rate.text("an expression in quotes")?.to_owned();
            let spread = state.entry("spread").map(|s| s.text("a quantity in quotes")).transpose()?;
            let spread = spread.map(str::to_owned);
            states.push(DraftState { name: name.to_owned(), rate, start, spread, sd: None });
        }
    }
    Ok(states)
}

/// Reads the experiments that distinguish the effect of a block from others.
fn separated_by(item: &Item<'_, '_>) -> Result<Vec<(String, String)>, ModelError> {
    let mut separated_by = Vec::new();
    if let Some(table) = item.entry("separated_by") {
        for (kind, text) in table.entries("a table of kinds, each with an experiment in quotes")? {
            separated_by.push((kind.to_owned(), text.text("an experiment in quotes")?.to_owned()));
        }
    }
    Ok(separated_by)
}

/// Reads the expression of an effect's block, and how it changes its target.
pub(crate) fn change(item: &Item<'_, '_>) -> Result<(How, String), ModelError> {
    let found: Vec<(How, Item<'_, '_>)> = [How::Add, How::Factor, How::Replace]
        .into_iter()
        .filter_map(|how| item.entry(how.key()).map(|text| (how, text)))
        .collect();
    match &found[..] {
        [(how, text)] => Ok((*how, text.number_or_text()?)),
        [] => {
            let example = "add = \"-c * abs(v_m_s)\"; `factor` and `replace` are possible too";
            Err(item.error(Fault::Missing { key: "add", example }))
        }
        [_, (_, second), ..] => {
            Err(second.wrong("left out: a block has only one of `add`, `factor` and `replace`"))
        }
    }
}

impl Cycle {
    fn read(item: &Item<'_, '_>) -> Result<Self, ModelError> {
        match item.text("\"period\" or \"frequency\"")? {
            "period" => Ok(Cycle::Period),
            "frequency" => Ok(Cycle::Frequency),
            _ => Err(item.wrong("\"period\" or \"frequency\"")),
        }
    }
}

impl RowParameter {
    fn read(name: &str, item: &Item<'_, '_>) -> Result<Self, ModelError> {
        let number_given = item.maybe_number();
        if number_given.is_none() {
            item.table("a table such as { min = 0.0 } or { of = \"v\", grid = [0.1, 0.3] }")?;
            item.check_keys(&[
                "of", "unit", "min", "max", "least", "null", "nominal", "typical", "grid", "scan", "cycle",
                "frozen",
            ])?;
        }
        let number = |key| item.entry(key).map(|n| n.number()).transpose();
        let list = |key| item.entry(key).map_or(Ok(Vec::new()), |l| l.numbers("a list of numbers"));
        let (mut grid, scan, nominal) = (list("grid")?, list("scan")?, number("nominal")?);
        grid.extend(number_given.or(nominal));
        let (min, max) =
            (number("min")?.unwrap_or(f64::NEG_INFINITY), number("max")?.unwrap_or(f64::INFINITY));
        if min >= max {
            return Err(item.error(Fault::EmptyBounds { min, max }));
        }
        let null = number("null")?;
        for value in grid.iter().chain(&scan).chain(&null) {
            if !(min..=max).contains(value) {
                return Err(item.error(Fault::OutsideBounds { value: *value, min, max }));
            }
        }
        let size = |key| {
            let text = |size: Item<'_, '_>| size.text("a text in quotes, such as \"v\"").map(str::to_owned);
            item.entry(key).map(text).transpose()
        };
        Ok(Self {
            name: name.to_owned(),
            unit: unit(item, name)?,
            of: size("of")?,
            least: size("least")?,
            frozen: item.entry("frozen").map_or(Ok(false), |f| f.flag())?,
            min,
            max,
            // A parameter without a grid is a coefficient that multiplies the effect, which vanishes at 0.
            null: null.or(grid.is_empty().then_some(0.0)),
            typical: number("typical")?,
            grid,
            scan,
            cycle: item.entry("cycle").map(|cycle| Cycle::read(&cycle)).transpose()?,
        })
    }

    /// Whether the effect does not vanish at any value of this parameter.
    pub fn is_inner(&self) -> bool {
        self.null.is_none()
    }
}
