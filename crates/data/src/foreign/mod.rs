//! Converts files that are no table of text into one: spreadsheets, JSON, MATLAB, HDF5, LabVIEW, zip archives.
//!
//! Every reader of recordings calls [`content`] first, so that all commands read the same formats. A format
//! that is not read is refused with its name and a conversion ([`kind`]).

mod brackets;
mod hdf5;
mod json;
mod kind;
mod labview;
mod matlab;
mod spreadsheet;

pub use kind::ForeignKind;

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::limits::Limit;
use crate::npz::{is_npz, read_npz_bytes};
use crate::push::archive::{is_zip, members, unpack};
use crate::push::{holds_trials, is_hdf5, is_named_like_a_trial, read_push_dataset_bytes};
use crate::sniff::Unrecognised;
use crate::source::Source;
use crate::whole_file::{gunzip, is_gzip};
use crate::{MissingCells, csv_long};
use std::path::Path;

/// Extensions of the text files that are read from a zip archive.
const TEXT_EXTENSIONS: [&str; 7] = ["csv", "tsv", "txt", "dat", "lvm", "jsonl", "ndjson"];
/// Prefix of a comment line whose text is shown in the notes on a recording.
pub(crate) const NOTE_MARK: &str = "augsim: ";

/// Content of a data file after unpacking and conversion.
pub(crate) enum Content {
    /// Text of a table with any separator and decimal mark.
    Text(Vec<u8>),
    /// Data set of a format with fixed names and units: NPZ or published pushes.
    Data(Dataset),
}

impl Content {
    /// Returns the content as text; a data set is written as CSV in the long form.
    pub(crate) fn into_text(self) -> Vec<u8> {
        match self {
            Content::Text(text) => text,
            Content::Data(data) => csv_long::csv_text(&data),
        }
    }
}

/// Unpacks the bytes of a file and converts known formats to text.
///
/// # Errors
/// The file is damaged, or its format is not read; the message names the format and a conversion.
pub(crate) fn content(path: &Path, mut bytes: Vec<u8>, missing: MissingCells) -> Result<Content, DataError> {
    if is_gzip(&bytes) {
        bytes = gunzip(path, &bytes)?;
    }
    if is_zip(&bytes) {
        return zipped(path, bytes, missing);
    }
    if is_hdf5(&bytes) {
        return match is_named_like_a_trial(path) || hdf5::holds_a_trial(&bytes) {
            true => read_push_dataset_bytes(path, bytes).map(Content::Data),
            false => hdf5::text(path, bytes).map(Content::Text),
        };
    }
    if json::is_json(&bytes) {
        if holds_trials(path, &bytes) {
            return read_push_dataset_bytes(path, bytes).map(Content::Data);
        }
        return json::text(path, &bytes).map(Content::Text);
    }
    if matlab::is_mat(&bytes) {
        return matlab::text(path, &bytes).map(Content::Text);
    }
    if let Some(kind) = ForeignKind::of(&bytes) {
        return Err(refused(path, Unrecognised::Format { kind }));
    }
    if labview::is_lvm(&bytes) {
        return labview::text(path, &bytes).map(Content::Text);
    }
    Ok(Content::Text(brackets::without_brackets(bytes)))
}

/// Converts a zip archive that holds NPZ, a spreadsheet, published pushes, or a single text file.
fn zipped(path: &Path, bytes: Vec<u8>, missing: MissingCells) -> Result<Content, DataError> {
    if is_npz(path, &bytes)? {
        return read_npz_bytes(path, &bytes, missing).map(Content::Data);
    }
    let names = members(path, &bytes)?;
    let is_sheet = |name: &String| name.starts_with("xl/worksheets/") && name.ends_with(".xml");
    if names.iter().any(|name| name == "xl/workbook.xml" || is_sheet(name)) {
        return spreadsheet::text(path, bytes, &names).map(Content::Text);
    }
    if names.iter().any(|name| name == "xl/workbook.bin" || name == "content.xml") {
        return Err(refused(path, Unrecognised::Format { kind: ForeignKind::SPREADSHEET }));
    }
    let is_hidden = |name: &str| {
        name.starts_with("__MACOSX/") || name.rsplit('/').next().is_some_and(|n| n.starts_with('.'))
    };
    let is_text = |name: &&String| {
        let extension = Path::new(name.as_str()).extension().map(|e| e.to_string_lossy().to_lowercase());
        !is_hidden(name) && extension.is_some_and(|e| TEXT_EXTENSIONS.contains(&e.as_str()))
    };
    let texts: Vec<String> = names.iter().filter(is_text).cloned().collect();
    match &texts[..] {
        [one] => {
            let mut unpacked = Vec::new();
            unpack(path, &bytes, std::slice::from_ref(one), |_, member| {
                unpacked = member;
                Ok(())
            })?;
            content(&path.join(one), unpacked, missing)
        }
        [] if names
            .iter()
            .any(|name| name.ends_with(".json") || name.ends_with(".h5") || name.ends_with(".hdf5")) =>
        {
            read_push_dataset_bytes(path, bytes).map(Content::Data)
        }
        [] => Err(refused(path, Unrecognised::Archive { files: names })),
        _ => Err(refused(path, Unrecognised::Archive { files: texts })),
    }
}

fn refused(path: &Path, reason: Unrecognised) -> DataError {
    DataError::NotRecognised { path: path.to_owned(), reason }
}

/// Creates the error for a file whose format is known and whose content cannot be read.
fn damaged(path: &Path, format: &'static str, cause: impl ToString) -> DataError {
    refused(path, Unrecognised::Damaged { format, cause: cause.to_string() })
}

/// Named vectors of numbers, in file order; they may have different lengths.
#[derive(Debug, Default)]
struct NamedVectors {
    vectors: Vec<(String, Vec<f64>)>,
}

impl NamedVectors {
    /// Adds a matrix, stored column by column, as one vector per column.
    fn add(&mut self, name: &str, rows: usize, columns: usize, values: &[f64]) {
        // A vector may lie along either dimension.
        let (rows, columns) = if rows == 1 { (columns, 1) } else { (rows, columns) };
        for (i, column) in values.chunks(rows.max(1)).take(columns).enumerate() {
            let name = if columns == 1 { name.to_owned() } else { format!("{name}_{}", i + 1) };
            self.vectors.push((name, column.to_vec()));
        }
    }

    /// Writes the vectors of one length as CSV: that of the time vector, or else the most frequent one.
    ///
    /// # Errors
    /// There is no vector of at least two numbers, or a limit is exceeded.
    fn text(self, path: &Path, format: &'static str) -> Result<Vec<u8>, DataError> {
        let is_time = |name: &str| ["t", "time", "t_s", "time_s"].contains(&name.to_lowercase().as_str());
        let lengths = || self.vectors.iter().map(|(_, v)| v.len()).filter(|n| *n > 1);
        let of_time =
            self.vectors.iter().find(|(name, v)| is_time(name) && v.len() > 1).map(|(_, v)| v.len());
        let most_frequent = lengths().max_by_key(|n| (lengths().filter(|other| other == n).count(), *n));
        let Some(rows) = of_time.or(most_frequent) else {
            let names = self.vectors.into_iter().map(|(name, _)| name).collect();
            return Err(refused(path, Unrecognised::NoVectors { format, names }));
        };
        let (kept, dropped): (Vec<_>, Vec<_>) = self.vectors.into_iter().partition(|(_, v)| v.len() == rows);
        check_cells(path, rows as u64 * kept.len() as u64)?;
        let mut out = String::new();
        if !dropped.is_empty() {
            let names: Vec<&str> = dropped.iter().map(|(name, _)| name.as_str()).collect();
            out += &format!(
                "# {NOTE_MARK}not read, because they have not {rows} values: {}\n",
                names.join(", ")
            );
        }
        let header: Vec<String> = kept.iter().map(|(name, _)| quoted(name)).collect();
        out += &(header.join(",") + "\n");
        for row in 0..rows {
            let cells =
                kept.iter().map(|(_, v)| if v[row].is_finite() { v[row].to_string() } else { String::new() });
            out += &(cells.collect::<Vec<_>>().join(",") + "\n");
        }
        Ok(out.into_bytes())
    }
}

/// Checks that a file has no more cells than the limit on cells allows.
fn check_cells(path: &Path, cells: u64) -> Result<(), DataError> {
    let origin = || Source::File(path.to_owned());
    Limit::Cells.check(cells).map_err(|cause| DataError::Limit { origin: origin(), cause })
}

/// Text as a CSV cell, in quotes where they are needed.
fn quoted(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    match text.contains([',', '"']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}
