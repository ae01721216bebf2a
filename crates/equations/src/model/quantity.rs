//! Reads numbers with units: parameters, and the unit of any quantity that has a name.

use super::toml_reader::Item;
use super::{GroupValues, Parameter};
use crate::error::{Fault, ModelError};
use augsim_data::{FileUnit, NonSiEnding, Unit, escaped_short, non_si_ending};

/// Reads a parameter: a number, or a table with its bounds.
pub(super) fn parameter(item: &Item<'_, '_>, name: &str) -> Result<Parameter, ModelError> {
    let expected = "a number or a table such as { nominal = 1.0, min = 0.0, max = 10.0 }";
    let nominal = match item.maybe_number() {
        Some(value) => value,
        None => {
            item.table(expected)?;
            item.check_keys(&[
                "nominal", "min", "max", "frozen", "unit", "ci95", "per", "groups", "group_sd",
            ])?;
            let missing = || item.error(Fault::Missing { key: "nominal", example: "nominal = 1.0" });
            item.entry("nominal").ok_or_else(missing)?.number()?
        }
    };
    let bound = |key, default| item.entry(key).map_or(Ok(default), |bound| bound.number());
    let (min, max) = (bound("min", f64::NEG_INFINITY)?, bound("max", f64::INFINITY)?);
    if min >= max {
        return Err(item.error(Fault::EmptyBounds { min, max }));
    }
    if !(min..=max).contains(&nominal) {
        return Err(item.error(Fault::OutsideBounds { value: nominal, min, max }));
    }
    Ok(Parameter {
        name: name.into(),
        unit: unit(item, name)?,
        nominal,
        min,
        max,
        frozen: item.entry("frozen").map_or(Ok(false), |frozen| frozen.flag())?,
        ci95: item.entry("ci95").map(|ci| ci.range()).transpose()?,
        by_group: group_values(item, (min, max))?,
        line: item.line,
    })
}

/// Reads the values by group of a parameter; `None` if it has one value for all groups.
fn group_values(item: &Item<'_, '_>, (min, max): (f64, f64)) -> Result<Option<GroupValues>, ModelError> {
    let words = [("all", false), ("group", true)];
    let is_by_group = item.entry("per").map(|per| per.word(&words, "\"all\" or \"group\"")).transpose()?;
    if is_by_group != Some(true) {
        let unused = ["groups", "group_sd"].into_iter().find_map(|key| item.entry(key));
        return match unused {
            Some(key) => Err(key.wrong("removed, or combined with per = \"group\"")),
            None => Ok(None),
        };
    }
    let mut values = Vec::new();
    if let Some(groups) = item.entry("groups") {
        for (name, entry) in groups.entries("a table of values, such as { unit1 = 0.2, unit2 = 0.3 }")? {
            let value = entry.number()?;
            if !(min..=max).contains(&value) {
                return Err(entry.error(Fault::OutsideBounds { value, min, max }));
            }
            values.push((name.to_owned(), value));
        }
    }
    let sd = item.entry("group_sd").map(|sd| sd.positive()).transpose()?;
    Ok(Some(GroupValues { values, sd }))
}

/// Reads the unit of a quantity from the key `unit`, or else from the end of its name.
///
/// # Errors
/// The name ends in a unit that is not SI. Its numbers would be read as those of the SI unit, or the units of the
/// equations would not be checked.
pub(super) fn unit(item: &Item<'_, '_>, name: &str) -> Result<Option<Unit>, ModelError> {
    let unit = match item.entry("unit") {
        Some(unit) => Some(unit_of(&unit)?),
        None => Unit::from_column_name(name),
    };
    match non_si_ending(name) {
        Some(NonSiEnding { ending, si_name, dimensions })
            if unit.is_none_or(|unit| unit.dimensions() == dimensions) =>
        {
            Err(item.error(Fault::NonSiEnding { ending, si_name }))
        }
        _ => Ok(unit),
    }
}

/// Reads a unit that is written as text in quotes.
pub(super) fn unit_of(unit: &Item<'_, '_>) -> Result<Unit, ModelError> {
    let text = unit.text("a unit in quotes, such as \"N/m\"")?;
    Unit::parse(text).ok_or_else(|| {
        unit.error(match FileUnit::parse(text) {
            Some(si) => Fault::NonSiUnit { text: escaped_short(text), si: si.unit().symbol() },
            None => Fault::UnknownUnit { text: escaped_short(text) },
        })
    })
}
