//! Reads parts that several sections share: tables, names, and keys with a unit at their end.

use super::toml_reader::Item;
use crate::error::{Fault, ModelError};
use crate::text;
use augsim_data::escaped_short;

/// Entries of a top-level table of a model file; none if the table is absent.
pub(super) fn section<'r, 't>(
    file: &Item<'r, 't>,
    key: &str,
    what: &'static str,
    allowed: usize,
) -> Result<Vec<(&'r str, Item<'r, 't>)>, ModelError> {
    let Some(table) = file.entry(key) else { return Ok(Vec::new()) };
    let entries = table.entries("a table, such as [states]")?;
    if entries.len() > allowed {
        return Err(table.error(Fault::TooMany { what, found: entries.len(), allowed }));
    }
    Ok(entries)
}

/// Checks that a name is neither malformed nor reserved.
pub(crate) fn check_name(item: &Item<'_, '_>, name: &str) -> Result<(), ModelError> {
    let begins_well = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if !begins_well || name.len() > 64 || !name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_') {
        return Err(item.error(Fault::MalformedName { name: escaped_short(name) }));
    }
    if text::is_reserved(name) {
        return Err(item.error(Fault::ReservedName { name: name.into() }));
    }
    Ok(())
}

/// Finds the entry with the key `kind` or `kind_UNIT`; `None` if there is none.
pub(super) fn suffixed<'r, 't>(item: &Item<'r, 't>, kind: &str) -> Option<Item<'r, 't>> {
    let entries = item.value.get_ref().as_table().map(|table| item.reader.entries(table))?;
    let matches =
        |name: &str| name.strip_prefix(kind).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
    let (name, ..) = entries.into_iter().find(|(name, ..)| matches(name))?;
    item.entry(name)
}

/// Lists the known keys, and the keys that were found with a unit at their end.
pub(super) fn known_with<'k>(known: &[&'k str], found: &'k [&Option<Item<'_, '_>>]) -> Vec<&'k str> {
    let suffixed = found.iter().filter_map(|item| item.as_ref()?.key.rsplit('.').next());
    known.iter().copied().chain(suffixed).collect()
}
