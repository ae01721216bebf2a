//! Reads `[[effect]]` and `[[candidate]]` blocks.
//!
//! Effects change the equations of a model; candidates are effects that discovery may try on it.

use super::entries::check_name;
use super::quantity::parameter;
use super::row::{Row, change};
use super::toml_reader::Item;
use super::{Draft, DraftTarget, Model, Parameter, Target};
use crate::error::{Fault, ModelError};
use crate::library::{generic, places_of, tables};
use crate::limits;
use crate::nearest::nearest;
use augsim_data::escaped_short;
use std::collections::BTreeSet;

/// Name of the kind of effect whose expression is given in its `[[effect]]` block.
const FORMULA: &str = "formula";
/// Name of the kind of effect whose values at knots are given in its `[[effect]]` block.
const TABLE: &str = "table";

/// Reads the `[[effect]]` and `[[candidate]]` blocks into `model`, whose equations are read already.
pub(super) fn read(file: &Item<'_, '_>, model: &mut Model) -> Result<(), ModelError> {
    let candidates = file.blocks("candidate", "written as [[candidate]] blocks")?;
    let effects = file.blocks("effect", "written as [[effect]] blocks")?;
    for (what, found) in [("candidates", candidates.len()), ("effects", effects.len())] {
        if found > limits::MAX_EFFECTS {
            return Err(file.error(Fault::TooMany { what, found, allowed: limits::MAX_EFFECTS }));
        }
    }
    for item in &candidates {
        let row = Row::read(item)?;
        places_of(&row, model)?;
        model.candidates.push(row);
    }
    for item in &effects {
        let draft = effect(item, model)?;
        model.add(&draft)?;
    }
    Ok(())
}

/// Reads one `[[effect]]` block.
fn effect(item: &Item<'_, '_>, model: &Model) -> Result<Draft, ModelError> {
    let missing = |key, example| item.error(Fault::Missing { key, example });
    let kind = item.entry("kind").ok_or_else(|| missing("kind", "kind = \"coulomb\""))?;
    let kind = kind.text("a name in quotes")?;
    let on = item
        .entry("on")
        .ok_or_else(|| missing("on", "on = \"omega_rad_s\", the quantity that it changes"))?;
    let on_text = on.text("the name of a rate, input, output or parameter")?;
    let with = item.entry("with").map(|w| w.text("a text in quotes").map(str::to_owned)).transpose()?;
    let texts =
        item.entry("also_fits").map(|list| list.texts("a list of expressions in quotes")).transpose()?;
    let mut draft = match kind {
        FORMULA => formula(item, (&on, on_text), model)?,
        TABLE => table(item, (&on, on_text), model)?,
        _ => library_effect(item, kind, (&on, on_text, with.as_deref()), model)?,
    };
    draft.equivalent_expressions = texts.unwrap_or_default();
    draft.line = item.line;
    Ok(draft)
}

/// Reads the parameters of an `[[effect]]` block: all keys except those in `known`.
fn parameters(item: &Item<'_, '_>, known: &[&str]) -> Result<Vec<Parameter>, ModelError> {
    let mut list = Vec::new();
    for (name, entry) in item.entries("written as [[effect]] blocks")? {
        if !known.contains(&name) {
            check_name(&entry, name)?;
            list.push(parameter(&entry, name)?);
        }
    }
    Ok(list)
}

/// Finds the quantity that an effect changes, by its name.
fn target(on: &Item<'_, '_>, name: &str, model: &Model) -> Result<Target, ModelError> {
    crate::library::target_named(name, model)
        .ok_or_else(|| on.error(Fault::NoSuchPlace { name: escaped_short(name) }))
}

/// Reads an `[[effect]]` block of kind `formula`.
fn formula(item: &Item<'_, '_>, on: (&Item<'_, '_>, &str), model: &Model) -> Result<Draft, ModelError> {
    let (how, text) = change(item)?;
    let parameters = parameters(item, &["kind", "on", "with", "add", "factor", "replace", "also_fits"])?;
    let to: DraftTarget = (target(on.0, on.1, model)?, how);
    let changes = vec![(to, text)];
    Ok(Draft { kind: FORMULA.into(), on: on.1.into(), parameters, changes, ..Draft::default() })
}

/// Reads an `[[effect]]` block of kind `table`: values at uniform knots of one quantity, constant outside.
fn table(item: &Item<'_, '_>, on: (&Item<'_, '_>, &str), model: &Model) -> Result<Draft, ModelError> {
    item.check_keys(&["kind", "on", "against", "first", "last", "values", "unit", "also_fits"])?;
    let missing = |key, example| item.error(Fault::Missing { key, example });
    let against = item.entry("against").ok_or_else(|| missing("against", "against = \"v_m_s\""))?;
    let against = against.text("an expression in quotes")?.to_owned();
    let number = |key, example| item.entry(key).ok_or_else(|| missing(key, example))?.number();
    let (first, last) = (number("first", "first = 0.0")?, number("last", "last = 1.0")?);
    if first >= last {
        return Err(item.error(Fault::KnotsDoNotRise { left: first, right: last }));
    }
    let values = item.entry("values").ok_or_else(|| missing("values", "values = [0.0, 0.1, 0.3]"))?;
    let values = values.numbers("a list of numbers")?;
    if values.len() < 2 {
        return Err(item.error(Fault::TooFewKnots { found: values.len() }));
    }
    if values.len() > limits::MAX_TABLE_KNOTS {
        let allowed = limits::MAX_TABLE_KNOTS;
        return Err(item.error(Fault::TooMany { what: "knots", found: values.len(), allowed }));
    }
    let to = target(on.0, on.1, model)?;
    Ok(tables::draft(to, on.1, &against, (first, last), &values))
}

/// Reads an `[[effect]]` block of a kind from the library, or from the candidates of the model file.
fn library_effect(
    item: &Item<'_, '_>,
    kind: &str,
    (on, on_text, with): (&Item<'_, '_>, &str, Option<&str>),
    model: &Model,
) -> Result<Draft, ModelError> {
    let rows: Vec<Row> = model.candidates.iter().cloned().chain(generic()?).collect();
    let rows_of_kind: Vec<&Row> = rows.iter().filter(|row| row.kind == kind).collect();
    if rows_of_kind.is_empty() {
        let known = rows.iter().map(|r| r.kind.as_str()).chain([FORMULA, TABLE]);
        return Err(
            item.error(Fault::NoSuchEffect { kind: escaped_short(kind), nearest: nearest(kind, known) })
        );
    }
    let mut places = Vec::new();
    for row in rows_of_kind {
        places.extend(places_of(row, model)?);
    }
    let is_requested = |c: &&crate::library::Candidate| {
        c.on == on_text && with.is_none_or(|with| c.with.as_deref() == Some(with))
    };
    let Some(candidate) = places.iter().find(is_requested) else {
        let (kind, on_place) = (kind.to_owned(), escaped_short(on_text));
        // The place may be right, and only its partner `with` wrong.
        let partners = places.iter().filter(|c| c.on == on_text).filter_map(|c| c.with.clone());
        let partners = BTreeSet::from_iter(partners).into_iter().collect();
        if let (Some(with), true) = (with, places.iter().any(|c| c.on == on_text)) {
            let (on, with) = (on_place, escaped_short(with));
            return Err(item.error(Fault::CannotGoWith { kind, on, with, partners }));
        }
        let possible = BTreeSet::from_iter(places.iter().map(|c| c.on.clone())).into_iter().collect();
        return Err(on.error(Fault::CannotActOn { kind, on: on_place, possible }));
    };
    let names: Vec<&str> = candidate.parameters.iter().map(|p| p.name.as_str()).collect();
    let keys: Vec<&str> =
        ["kind", "on", "with", "also_fits"].into_iter().chain(names.iter().copied()).collect();
    item.check_keys(&keys)?;
    let mut draft = candidate.draft(&candidate.nulls());
    for (drafted, declared) in draft.parameters.iter_mut().zip(&candidate.parameters) {
        let Some(entry) = item.entry(&drafted.name) else {
            return Err(item.error(Fault::MissingParameter { name: drafted.name.clone(), kind: kind.into() }));
        };
        let read = parameter(&entry, &drafted.name)?;
        let unit = read.unit.or(declared.unit);
        *drafted = Parameter { unit, frozen: read.frozen || declared.frozen, ..read };
    }
    Ok(draft)
}
