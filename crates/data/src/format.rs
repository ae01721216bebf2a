//! Which layout a file has, told by its content.

use crate::csv_long::{MissingCells, read_long, write_csv};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::legacy_ball::read_ball;
use crate::npz::{is_npz, npz_of_bytes, write_npz};
use crate::push::{holds_trial, push_dataset_of_bytes, read_push_dataset};
use crate::whole_file::read_whole;
use std::path::Path;

/// Bytes from the beginning of a file that tell its layout.
const TELLING: usize = 64;

/// Reads a data set in any layout that this crate knows: CSV in long form or the ball layout
/// `traj,step,t,height,velocity`, plain or gzip; NPZ; and the published push files (HDF5, JSON, a zip archive
/// or a folder of them). `-` is standard input; a FIFO or `/dev/stdin` is read like any file.
///
/// # Errors
/// Any of the readers' [`DataError`]s. A file of none of these layouts is reported as a faulty long form.
pub fn read_dataset(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    if path.is_dir() {
        return read_push_dataset(path);
    }
    let bytes = read_whole(path)?;
    if bytes.starts_with(b"PK") && is_npz(path, &bytes)? {
        return npz_of_bytes(path, &bytes, missing);
    }
    if holds_trial(&bytes[..bytes.len().min(TELLING)]) {
        return push_dataset_of_bytes(path, bytes);
    }
    let source = CsvSource::of_bytes(path, bytes)?;
    if source.header() == ["traj", "step", "t", "height", "velocity"] {
        return read_ball(source);
    }
    read_long(source, missing)
}

/// Reads the CSV file in long form that a table in memory would be written to; `name` is for messages.
///
/// # Errors
/// The errors of [`read_csv`](crate::read_csv).
pub fn read_table(name: &str, csv: Vec<u8>, missing: MissingCells) -> Result<Dataset, DataError> {
    read_long(CsvSource::of_bytes(Path::new(name), csv)?, missing)
}

/// Writes a data set, as NPZ where the name ends in `.npz`, otherwise as CSV in long form; all or nothing.
///
/// # Errors
/// The errors of [`write_csv`] and [`write_npz`].
pub fn write_dataset(dataset: &Dataset, path: &Path) -> Result<(), DataError> {
    match path.extension().is_some_and(|extension| extension == "npz") {
        true => write_npz(dataset, path),
        false => write_csv(dataset, path),
    }
}
