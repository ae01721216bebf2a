//! Reads the ball layout `traj,step,t,height,velocity` of the simulated bouncing-ball set.
//!
//! The layout is older than column names with units. Its units are fixed: `t` in s, `height` of the lowest
//! point of the ball in m, `velocity` upwards in m/s. `step` is the index of the sample; it is redundant, so
//! it is checked to be a whole number and dropped.

use crate::assemble::Assembler;
use crate::column::Column;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::source::Source;
use std::path::Path;

const LAYOUT: &str = "the ball layout is `traj,step,t,height,velocity`";

/// Reads a file with the header `traj,step,t,height,velocity` as columns `height_m` and `velocity_m_s`.
///
/// # Errors
/// A [`DataError`] with file, line, column and remedy.
pub fn read_legacy_ball(path: &Path) -> Result<Dataset, DataError> {
    read_ball(CsvSource::open(path)?)
}

/// Like [`read_legacy_ball`], for a file whose header was already read.
pub(crate) fn read_ball(mut source: CsvSource) -> Result<Dataset, DataError> {
    let path = source.path().to_owned();
    let id = source.require("traj", LAYOUT)?;
    let step = source.require("step", LAYOUT)?;
    let time = source.require("t", LAYOUT)?;
    let measured = [source.require("height", LAYOUT)?, source.require("velocity", LAYOUT)?];
    let columns = vec![Column::new("height_m")?, Column::new("velocity_m_s")?];
    let mut rows = Assembler::new(path.clone(), "traj", "t", columns.len());
    while source.next_row()? {
        let number = |cell| source.required_number(cell);
        if number(step)?.fract() != 0.0 {
            return Err(DataError::BadNumber {
                path,
                line: source.line(),
                column: "step".to_owned(),
                cell: source.text(step)?.to_owned(),
            });
        }
        let label = source.label(id)?;
        let values = [number(measured[0])?, number(measured[1])?];
        rows.push(source.line(), label, None, number(time)?, &values)?;
    }
    Dataset::with_origin(columns, rows.finish()?, Source::File(path))
}
