//! Which layout a file has, told by its content.

use crate::csv_long::{MissingCells, read_long};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::legacy_ball::read_ball;
use std::path::Path;

/// Reads a data set in any layout that this crate knows: CSV in long form, or the ball layout
/// `traj,step,t,height,velocity`, plain or gzip.
///
/// # Errors
/// Any of the readers' [`DataError`]s. A file of neither layout is reported as a faulty long form.
pub fn read_dataset(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    let source = CsvSource::open(path)?;
    if source.header() == ["traj", "step", "t", "height", "velocity"] {
        return read_ball(source);
    }
    read_long(source, missing)
}
