//! Which layout a file has, told by its content.

use crate::csv_long::{MissingCells, read_long, write_csv};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::legacy_ball::read_ball;
use crate::npz::{is_npz, read_npz, write_npz};
use crate::push::{holds_trial, read_push_dataset};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Reads a data set in any layout that this crate knows: CSV in long form or the ball layout
/// `traj,step,t,height,velocity`, plain or gzip; NPZ; and the published push files (HDF5, JSON, a zip archive
/// or a folder of them).
///
/// # Errors
/// Any of the readers' [`DataError`]s. A file of none of these layouts is reported as a faulty long form.
pub fn read_dataset(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    if path.is_dir() {
        return read_push_dataset(path);
    }
    let begin = first_bytes(path)?;
    if begin.starts_with(b"PK") && is_npz(path)? {
        return read_npz(path, missing);
    }
    if holds_trial(&begin) {
        return read_push_dataset(path);
    }
    let source = CsvSource::open(path)?;
    if source.header() == ["traj", "step", "t", "height", "velocity"] {
        return read_ball(source);
    }
    read_long(source, missing)
}

/// Writes a data set, as NPZ where the name ends in `.npz`, otherwise as CSV in long form; all or nothing.
///
/// # Errors
/// As [`write_csv`] and [`write_npz`].
pub fn write_dataset(dataset: &Dataset, path: &Path) -> Result<(), DataError> {
    match path.extension().is_some_and(|extension| extension == "npz") {
        true => write_npz(dataset, path),
        false => write_csv(dataset, path),
    }
}

/// Enough of the file to tell its layout.
fn first_bytes(path: &Path) -> Result<Vec<u8>, DataError> {
    let mut begin = Vec::new();
    let read = File::open(path).and_then(|file| file.take(64).read_to_end(&mut begin));
    read.map_err(|cause| DataError::Unreadable { path: path.to_owned(), cause })?;
    Ok(begin)
}
