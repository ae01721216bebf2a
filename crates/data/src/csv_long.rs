//! CSV in long form: one row per sample, `trajectory,t_s,` and columns whose names end in their unit.
//!
//! ```csv
//! trajectory,t_s,height_m,velocity_m_s
//! 0,0,4.41,0
//! 0,0.016666666666666666,4.4073,-0.16333
//! ```
//! The rows of a trajectory are contiguous and its times increase; lengths and sampling intervals may differ
//! between trajectories. The optional column `group` holds a text label, the same in every row of a
//! trajectory. The columns may be in any order. The file is plain text or gzip, which is recognised from its
//! content.

use crate::assemble::Assembler;
use crate::atomic_file::atomic_write;
use crate::column::{Column, GROUP, TIME, TRAJECTORY};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::{DataError, EVERY_SAMPLE_NEEDS_A_TIME, EVERY_VALUE_IS_NEEDED};
use crate::source::Source;
use flate2::{Compression, write::GzEncoder};
use std::io::{self, Write};
use std::path::Path;

const LAYOUT: &str = "the long form is comma-separated and starts with \
                      `trajectory,t_s,` followed by columns that end in their unit";

/// Decides whether an empty cell in a column of measured values is an error or a gap.
///
/// Only an empty cell is a gap: the words NaN, null or NA are errors in both cases. Trajectory, time and
/// group must never be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MissingCells {
    /// An empty cell is an error; for simulators and nets, which need every value.
    #[default]
    Refuse,
    /// An empty cell is a gap, such as a position that a tracker lost; it is stored as NaN and written back empty.
    AsGap,
}

/// Reads a data set from CSV in long form (one row per sample), plain or gzip.
///
/// # Errors
/// Any of the reader's [`DataError`]s, with file, line, column and remedy.
pub fn read_csv(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    read_long(CsvSource::open(path)?, missing)
}

/// Like [`read_csv`], for a file whose header was already read.
pub(crate) fn read_long(mut source: CsvSource, missing: MissingCells) -> Result<Dataset, DataError> {
    let path = source.path().to_owned();
    let id_cell = source.require(TRAJECTORY, LAYOUT)?;
    let time_cell = source.require(TIME, LAYOUT)?;
    let group_cell = source.header().iter().position(|name| name == GROUP);
    let mut columns = Vec::new();
    let mut value_cells = Vec::new();
    for (cell, name) in source.header().iter().enumerate() {
        if cell == id_cell || cell == time_cell || Some(cell) == group_cell {
            continue;
        }
        let bad = |cause| DataError::BadColumn { path: path.clone(), cause };
        columns.push(Column::new(name).map_err(bad)?);
        value_cells.push(cell);
    }
    if columns.is_empty() {
        return Err(DataError::NoValueColumns { path });
    }

    let mut rows = Assembler::new(path.clone(), TRAJECTORY, TIME, columns.len());
    let mut values = vec![0.0; columns.len()];
    while source.next_row()? {
        let id = source.label(id_cell)?;
        let group = group_cell.map(|cell| source.label(cell)).transpose()?;
        let time_s = source
            .number(time_cell)?
            .ok_or_else(|| source.empty_cell(time_cell, EVERY_SAMPLE_NEEDS_A_TIME))?;
        for (value, &cell) in values.iter_mut().zip(&value_cells) {
            *value = match (source.number(cell)?, missing) {
                (Some(number), _) => number,
                (None, MissingCells::AsGap) => f64::NAN,
                (None, MissingCells::Refuse) => {
                    return Err(source.empty_cell(cell, EVERY_VALUE_IS_NEEDED));
                }
            };
        }
        rows.push(source.line(), id, group, time_s, &values)?;
    }
    let trajectories = rows.finish()?;
    Dataset::with_origin(columns, trajectories, Source::File(path))
}

/// Writes `dataset` atomically in long form, gzip where the name ends in `.gz`.
///
/// Numbers are written with the fewest digits that read back to the same bits, so reading returns an equal
/// data set.
///
/// ```
/// use augsim_data::{Dataset, MissingCells, Trajectory, read_csv, write_csv};
/// let run = Trajectory::new("a", vec![0.0, 0.1], vec![vec![1.0, f64::NAN]])?;
/// let data = Dataset::from_names(&["height_m"], vec![run])?;
/// let file = std::env::temp_dir().join(format!("augsim-doc-{}.csv", std::process::id()));
/// write_csv(&data, &file)?;
/// assert_eq!(std::fs::read_to_string(&file).unwrap(), "trajectory,t_s,height_m\na,0,1\na,0.1,\n");
/// assert_eq!(read_csv(&file, MissingCells::AsGap)?.trajectories()[0].column(0)[0], 1.0);
/// # std::fs::remove_file(&file).unwrap();
/// # Ok::<(), augsim_data::DataError>(())
/// ```
///
/// # Errors
/// The data set has no trajectories, or the file cannot be written.
pub fn write_csv(dataset: &Dataset, path: &Path) -> Result<(), DataError> {
    if dataset.trajectories().is_empty() {
        return Err(DataError::NothingToWrite { path: path.to_owned() });
    }
    let gzip = path.extension().is_some_and(|extension| extension == "gz");
    atomic_write(path, |file| {
        if gzip {
            let mut encoder = GzEncoder::new(file, Compression::default());
            write_rows(dataset, &mut encoder)?;
            encoder.finish().map(|_| ())
        } else {
            write_rows(dataset, file)
        }
    })?;
    Ok(())
}

/// Writes a data set as CSV text in the long form.
pub(crate) fn csv_text(dataset: &Dataset) -> Vec<u8> {
    let mut out = Vec::new();
    // Writing to a vector cannot fail.
    let _ = write_rows(dataset, &mut out);
    out
}

fn write_rows(dataset: &Dataset, out: &mut dyn Write) -> io::Result<()> {
    let has_groups = dataset.trajectories().iter().any(|t| t.group().is_some());
    let mut rows = csv::Writer::from_writer(out);
    let fixed_names = if has_groups { &[TRAJECTORY, GROUP, TIME][..] } else { &[TRAJECTORY, TIME][..] };
    let names = dataset.columns().iter().map(Column::name);
    rows.write_record(fixed_names.iter().copied().chain(names))?;
    for trajectory in dataset.trajectories() {
        for (sample, time_s) in trajectory.time_s().iter().enumerate() {
            rows.write_field(trajectory.id())?;
            if let Some(group) = trajectory.group() {
                rows.write_field(group)?;
            }
            rows.write_field(time_s.to_string())?;
            for column in trajectory.values() {
                let value = column[sample];
                let cell = if value.is_nan() { String::new() } else { value.to_string() };
                rows.write_field(cell)?;
            }
            rows.write_record(None::<&[u8]>)?;
        }
    }
    rows.flush()
}
