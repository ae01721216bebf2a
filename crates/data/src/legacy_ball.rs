//! The layout of the regenerated bouncing-ball set: `traj,step,t,height,velocity`.
//!
//! It predates names with units. Its units are fixed: `t` in s, `height` of the ball's underside in
//! m, `velocity` upwards in m/s. `step` counts the samples of a trajectory and repeats what `t`
//! says, so it is checked to be a whole number and dropped.

use crate::assemble::Assembler;
use crate::column::Column;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::source::Source;
use std::path::Path;

const LAYOUT: &str = "the ball layout is `traj,step,t,height,velocity`";

/// Reads a file of that layout as columns `height_m` and `velocity_m_s`.
///
/// # Errors
/// Any of the reader's [`DataError`]s, with file, line, column and remedy.
pub fn read_legacy_ball(path: &Path) -> Result<Dataset, DataError> {
    read_ball(CsvSource::open(path)?)
}

pub(crate) fn read_ball(mut source: CsvSource) -> Result<Dataset, DataError> {
    let path = source.path().to_owned();
    let id = source.require("traj", LAYOUT)?;
    let step = source.require("step", LAYOUT)?;
    let time = source.require("t", LAYOUT)?;
    let measured = [source.require("height", LAYOUT)?, source.require("velocity", LAYOUT)?];
    let columns = vec![Column::new("height_m")?, Column::new("velocity_m_s")?];
    let mut rows = Assembler::new(path.clone(), "traj", "t", columns.len());
    while source.next_row()? {
        let number =
            |cell| source.number(cell)?.ok_or_else(|| source.empty_cell(cell, "this layout has no gaps"));
        if number(step)?.fract() != 0.0 {
            return Err(DataError::BadNumber {
                path,
                line: source.line(),
                column: "step".to_owned(),
                cell: source.text(step)?.to_owned(),
            });
        }
        let id_text = source.text(id)?;
        if id_text.is_empty() {
            return Err(source.empty_cell(id, "every row needs it"));
        }
        let values = [number(measured[0])?, number(measured[1])?];
        rows.push(source.line(), id_text, None, number(time)?, &values)?;
    }
    Dataset::with_origin(columns, rows.finish()?, Source::File(path))
}
