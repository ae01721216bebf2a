//! Reads tables in JSON: a list of records, columns by name, rows of numbers, or one record per line.

use super::{check_cells, damaged, quoted};
use crate::error::DataError;
use crate::sniff::Unrecognised;
use serde_json::{Map, Value};
use std::path::Path;

const FORMAT: &str = "JSON";

/// Whether a text begins like JSON: an object with a key, or a list of objects, lists or names.
pub(super) fn is_json(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut begin = bytes.iter().filter(|b| !b.is_ascii_whitespace());
    matches!((begin.next(), begin.next()), (Some(b'{'), Some(b'"' | b'}')) | (Some(b'['), Some(b'{' | b'[')))
}

/// Converts a table in JSON to CSV text.
///
/// # Errors
/// The text is not JSON, or is no table.
pub(super) fn text(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, DataError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // A parsed value takes many times its bytes, so values are counted before.
    check_cells(path, bytes.iter().filter(|b| **b == b',').count() as u64)?;
    let mut values = serde_json::Deserializer::from_slice(bytes).into_iter::<Value>();
    let mut parsed = Vec::new();
    for value in &mut values {
        parsed.push(value.map_err(|e| damaged(path, FORMAT, hint(bytes, &e)))?);
    }
    let rows = match (parsed.len(), parsed.pop()) {
        (1, Some(one)) => rows_of(one),
        (_, Some(last)) => rows_of(Value::Array(parsed.into_iter().chain([last]).collect())),
        (_, None) => None,
    };
    let (names, rows) =
        rows.ok_or_else(|| super::refused(path, Unrecognised::NotATable { format: FORMAT }))?;
    let mut out = String::new();
    if !names.is_empty() {
        out += &(names.iter().map(|n| quoted(n)).collect::<Vec<_>>().join(",") + "\n");
    }
    for row in rows {
        out += &(row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n");
    }
    Ok(out.into_bytes())
}

/// Message for a JSON syntax error, with a remedy where the text holds NaN or Infinity as Python writes them.
fn hint(bytes: &[u8], error: &serde_json::Error) -> String {
    let has_nan = [&b"NaN"[..], b"Infinity"].iter().any(|word| bytes.windows(word.len()).any(|w| w == *word));
    match has_nan {
        true => format!("{error}; NaN and Infinity are not JSON: write null"),
        false => error.to_string(),
    }
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::Bool(flag) => u8::from(*flag).to_string(),
        Value::String(text) => quoted(text),
        Value::Number(number) => number.to_string(),
        // Nested values are text that no column of numbers has.
        nested => quoted(&nested.to_string()),
    }
}

/// Column names and rows of a table in JSON; `None` where the value is no table.
///
/// The names are empty for plain rows of numbers.
fn rows_of(value: Value) -> Option<(Vec<String>, Vec<Vec<Value>>)> {
    match value {
        Value::Array(items) => match items.first()? {
            Value::Object(_) => records(items),
            Value::Array(_) => {
                let rows = items.into_iter().map(|item| match item {
                    Value::Array(row) => Some(row),
                    _ => None,
                });
                Some((Vec::new(), rows.collect::<Option<Vec<_>>>()?))
            }
            _ => None,
        },
        Value::Object(mut map) => {
            if let Some(table) = columns(&map) {
                return Some(table);
            }
            // A table may be under a key beside a description, as in {"name": …, "data": […]}.
            let inner = map.values_mut().filter(|v| v.is_array() || v.is_object());
            let mut tables = inner.filter_map(|v| rows_of(v.take()));
            let found = tables.next()?;
            tables.next().is_none().then_some(found)
        }
        _ => None,
    }
}

/// Column names and rows of a list of JSON objects; a key that an object lacks is an empty cell.
fn records(items: Vec<Value>) -> Option<(Vec<String>, Vec<Vec<Value>>)> {
    let mut names: Vec<String> = Vec::new();
    let mut maps: Vec<Map<String, Value>> = Vec::with_capacity(items.len());
    for item in items {
        let Value::Object(map) = item else { return None };
        for name in map.keys() {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        maps.push(map);
    }
    let row = |mut map: Map<String, Value>| names.iter().map(|n| map.remove(n).unwrap_or_default()).collect();
    let rows = maps.into_iter().map(row).collect();
    Some((names, rows))
}

/// Column names and rows of a JSON object with one list, or one object by row number (pandas), per column.
fn columns(map: &Map<String, Value>) -> Option<(Vec<String>, Vec<Vec<Value>>)> {
    let values = |value: &Value| -> Option<Vec<Value>> {
        match value {
            Value::Array(list) if !list.iter().any(|v| v.is_array() || v.is_object()) => Some(list.clone()),
            Value::Object(rows) => {
                let mut list: Vec<(u64, Value)> =
                    rows.iter().map(|(k, v)| Some((k.parse().ok()?, v.clone()))).collect::<Option<_>>()?;
                list.sort_by_key(|(k, _)| *k);
                Some(list.into_iter().map(|(_, v)| v).collect())
            }
            _ => None,
        }
    };
    let lists: Vec<(String, Vec<Value>)> =
        map.iter().filter_map(|(name, v)| Some((name.clone(), values(v)?))).collect();
    let length = lists.first()?.1.len();
    if length < 2 || lists.iter().any(|(_, list)| list.len() != length) {
        return None;
    }
    let rows = (0..length).map(|k| lists.iter().map(|(_, list)| list[k].clone()).collect()).collect();
    Some((lists.into_iter().map(|(name, _)| name).collect(), rows))
}
