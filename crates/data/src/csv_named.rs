//! Reads the columns of CSV files that a model names, with the units of the model.

use crate::assemble::Assembler;
use crate::column::{Column, GROUP, TIME, TRAJECTORY};
use crate::csv_long::MissingCells;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::{DataError, EVERY_SAMPLE_NEEDS_A_TIME};
use crate::foreign::content;
use crate::sniff::{files_in, in_long_form, stem};
use crate::source::Source;
use crate::trajectory::Trajectory;
use crate::unit::Unit;
use crate::whole_file::read_whole;
use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

const LAYOUT: &str = "the long form is comma-separated and has the sample times in the column `t_s`";

/// Identifier of the only trajectory of a file without the column `trajectory`.
const SINGLE_ID: &str = "1";

/// A CSV file whose header was read, or a folder of such files with one recording each.
pub struct NamedCsv {
    path: PathBuf,
    /// At least one file; those of a folder are sorted by name.
    files: Vec<NamedFile>,
}

/// One CSV file.
struct NamedFile {
    /// Name of the recording, where the file is in a folder.
    recording: Option<String>,
    source: CsvSource,
}

impl fmt::Debug for NamedCsv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NamedCsv").field("path", &self.path).finish_non_exhaustive()
    }
}

impl NamedCsv {
    /// Opens a file, plain or gzip, or all recordings in a folder.
    ///
    /// A file that is not in the long form may have any separator and decimal mark, another name of the time
    /// column, and units in its column names, which are converted to SI.
    ///
    /// # Errors
    /// The file cannot be read or is not CSV, or the folder has no recordings.
    pub fn open(path: &Path) -> Result<Self, DataError> {
        if !path.is_dir() {
            return Ok(Self::of_file(path, open_file(path)?));
        }
        let mut files = Vec::new();
        for file in files_in(path)? {
            files.push(NamedFile { recording: Some(stem(&file)), source: open_file(&file)? });
        }
        Ok(Self { path: path.to_owned(), files })
    }

    fn of_file(path: &Path, source: CsvSource) -> Self {
        Self { path: path.to_owned(), files: vec![NamedFile { recording: None, source }] }
    }

    /// Opens a CSV text in memory; `name` stands for the file name in messages.
    ///
    /// # Errors
    /// The text is not CSV.
    pub fn from_csv(name: &str, csv: Vec<u8>) -> Result<Self, DataError> {
        let path = Path::new(name);
        Ok(Self::of_file(path, CsvSource::from_bytes(path, csv)?))
    }

    /// Names in the header; for a folder, those of its first file.
    pub fn header(&self) -> &[String] {
        self.files.first().map_or(&[], |file| file.source.header())
    }

    /// Reads the columns `wanted` with their units; an empty cell is a gap.
    ///
    /// A file without the column `trajectory` holds one trajectory, which in a folder has the name of the
    /// file. In a folder, the trajectories of a file with several are named `file/trajectory`.
    ///
    /// # Errors
    /// A column is missing or a row cannot be read; the [`DataError`] states file, line, column and remedy.
    pub fn read(self, wanted: &[(&str, Unit)]) -> Result<Dataset, DataError> {
        self.read_with_clock(TIME, wanted)
    }

    /// Like [`read`](Self::read), with the column `clock` as the time.
    ///
    /// # Errors
    /// The errors of [`read`](Self::read).
    pub fn read_with_clock(self, clock: &str, wanted: &[(&str, Unit)]) -> Result<Dataset, DataError> {
        let mut columns = Vec::with_capacity(wanted.len());
        for (name, unit) in wanted {
            let bad = |cause| DataError::BadColumn { path: self.path.clone(), cause };
            columns.push(Column::with_unit(name, *unit).map_err(bad)?);
        }
        if columns.is_empty() {
            return Err(DataError::NoValueColumns { path: self.path });
        }
        let names: Vec<&str> = wanted.iter().map(|(name, _)| *name).collect();
        let mut trajectories = Vec::new();
        for file in self.files {
            trajectories.extend(file.read(clock, &names)?);
        }
        Dataset::with_origin(columns, trajectories, Source::File(self.path))
    }
}

impl NamedFile {
    /// Reads the trajectories of the file with the columns `wanted`.
    fn read(self, clock: &str, wanted: &[&str]) -> Result<Vec<Trajectory>, DataError> {
        let mut source = self.source;
        let position = |name: &str| source.header().iter().position(|n| n == name);
        let (id_cell, group_cell) = (position(TRAJECTORY), position(GROUP));
        let time_cell = source.require(clock, LAYOUT)?;
        let cells = wanted.iter().map(|name| source.require(name, LAYOUT)).collect::<Result<Vec<_>, _>>()?;
        let mut rows = Assembler::new(source.path().to_owned(), TRAJECTORY, TIME, cells.len());
        let mut values = vec![0.0; cells.len()];
        while source.next_row()? {
            let label = |cell: usize| source.label(cell);
            let id_in_file = id_cell.map(label).transpose()?;
            let id: Cow<'_, str> = match (&self.recording, id_in_file) {
                (Some(recording), Some(id)) => format!("{recording}/{id}").into(),
                (Some(recording), None) => recording.as_str().into(),
                (None, id) => id.unwrap_or(SINGLE_ID).into(),
            };
            let group = group_cell.map(label).transpose()?;
            let missing = || source.empty_cell(time_cell, EVERY_SAMPLE_NEEDS_A_TIME);
            let time_s = source.number(time_cell)?.ok_or_else(missing)?;
            for (value, &cell) in values.iter_mut().zip(&cells) {
                *value = source.number(cell)?.unwrap_or(f64::NAN);
            }
            rows.push(source.line(), &id, group, time_s, &values)?;
        }
        rows.finish()
    }
}

/// Opens a file in the long form, or in another layout whose time column can be inferred.
fn open_file(path: &Path) -> Result<CsvSource, DataError> {
    let bytes = content(path, read_whole(path)?, MissingCells::AsGap)?.into_text();
    let strict = CsvSource::from_bytes(path, bytes.clone());
    if strict.as_ref().is_ok_and(|source| source.header().iter().any(|name| name == TIME)) {
        return strict;
    }
    match in_long_form(path, &bytes) {
        Some(bytes) => CsvSource::from_bytes(path, bytes),
        None => strict,
    }
}
