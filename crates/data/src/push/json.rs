//! Reads a trial from JSON: an object with one array of rows per stream.

use super::error::PushError;
use super::fault::{FilePart, StreamLayout};
use crate::limits::Limit;
use serde_json::value::RawValue;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads the rows (time and three values) of the sensor streams `keys` from a JSON text.
pub(super) fn rows<const N: usize>(
    path: &Path,
    bytes: &[u8],
    keys: [&'static str; N],
) -> Result<[Vec<[f64; 4]>; N], PushError> {
    let members: BTreeMap<String, Box<RawValue>> =
        serde_json::from_slice(bytes).map_err(|cause| syntax_error(path, bytes, cause))?;
    let mut streams: [Vec<[f64; 4]>; N] = std::array::from_fn(|_| Vec::new());
    for (rows, key) in streams.iter_mut().zip(keys) {
        let raw = members.get(key).ok_or_else(|| PushError::MissingStream {
            path: path.to_owned(),
            key,
            found: members.keys().cloned().collect(),
        })?;
        let layout = |found: StreamLayout| PushError::Layout { path: path.to_owned(), key, found };
        // Rows and cells take many times their bytes in the file, so both are counted before parsing.
        let count = |mark: u8| raw.get().bytes().filter(|&byte| byte == mark).count() as u64;
        Limit::Samples.check(count(b'[').max(count(b',') / 4)).map_err(|cause| PushError::Limit {
            path: path.to_owned(),
            part: FilePart::Stream(key),
            cause,
        })?;
        let cells: Vec<Vec<Option<f64>>> =
            serde_json::from_str(raw.get()).map_err(|cause| layout(StreamLayout::NotRows { cause }))?;
        for (row, cells) in cells.iter().enumerate() {
            let [t, a, b, c] = cells[..] else {
                return Err(layout(StreamLayout::Row { row, numbers: cells.len() }));
            };
            match (t, a, b, c) {
                (Some(t), Some(a), Some(b), Some(c)) => rows.push([t, a, b, c]),
                _ => return Err(PushError::NotFinite { path: path.to_owned(), key: key.to_owned(), row }),
            }
        }
    }
    Ok(streams)
}

/// Creates the error for invalid JSON; NaN and Infinity, which Python writes, are reported with stream and row.
fn syntax_error(path: &Path, bytes: &[u8], cause: serde_json::Error) -> PushError {
    let offset: usize =
        bytes.split_inclusive(|&b| b == b'\n').take(cause.line().saturating_sub(1)).map(<[u8]>::len).sum();
    let position = (offset + cause.column()).min(bytes.len());
    let before = String::from_utf8_lossy(&bytes[..position.saturating_sub(1)]);
    let here = String::from_utf8_lossy(&bytes[position.saturating_sub(2)..(position + 12).min(bytes.len())]);
    let stream = before.rsplit('"').nth(1);
    match stream {
        Some(key) if here.contains("NaN") || here.contains("Infinity") => {
            let rows = before.rsplit('"').next().unwrap_or_default().matches('[').count();
            PushError::NotFinite { path: path.to_owned(), key: key.to_owned(), row: rows.saturating_sub(2) }
        }
        _ => PushError::Json { path: path.to_owned(), cause },
    }
}
