//! Access to golden values: results of independent implementations, stored under `fixtures/golden`.

use serde_json::Value;
use std::path::PathBuf;

/// Path of a file under `fixtures/`.
pub fn fixture(path: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures")).join(path)
}

/// Reads a golden JSON file under `fixtures/golden`.
///
/// # Panics
/// If the file, which is part of the repository, is missing or malformed.
pub fn golden(name: &str) -> Value {
    let path = fixture("golden").join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The numbers of a nested JSON array, row-major.
pub fn flat(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        other => vec![other.as_f64().unwrap_or(f64::NAN)],
    }
}

/// The dimensions of a nested JSON array.
pub fn dims(v: &Value) -> Vec<usize> {
    let mut out = Vec::new();
    let mut level = v;
    while let Value::Array(items) = level {
        out.push(items.len());
        match items.first() {
            Some(first) => level = first,
            None => break,
        }
    }
    out
}

/// The numbers of a JSON array `[batch, time, feature]`, reordered to `[time, feature, batch]`.
pub fn batch_last(v: &Value) -> Vec<f64> {
    let (d, x) = (dims(v), flat(v));
    let (b, t, f) = (d[0], d[1], d[2]);
    let mut out = Vec::with_capacity(x.len());
    for ti in 0..t {
        for fi in 0..f {
            out.extend((0..b).map(|bi| x[(bi * t + ti) * f + fi]));
        }
    }
    out
}
