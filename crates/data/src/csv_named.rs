//! CSV in long form of which a model names some columns: their units are the model's, and the others are left alone.

use crate::assemble::Assembler;
use crate::column::{Column, GROUP, TIME, TRAJECTORY};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::sniff::{files_in, in_long_form, stem};
use crate::source::Source;
use crate::trajectory::Trajectory;
use crate::unit::Unit;
use crate::whole_file::read_whole;
use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

const LAYOUT: &str = "the long form is comma-separated and has the times of its rows in `t_s`";

/// Identifier of the one trajectory of a file without the column `trajectory`.
const ONLY: &str = "1";

/// A CSV file whose header was read, or a folder of such files, a recording each.
pub struct NamedCsv {
    path: PathBuf,
    /// At least one; those of a folder by name.
    files: Vec<NamedFile>,
}

/// One file.
struct NamedFile {
    /// Name of the recording in a folder of several.
    recording: Option<String>,
    source: CsvSource,
}

impl fmt::Debug for NamedCsv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NamedCsv").field("path", &self.path).finish_non_exhaustive()
    }
}

impl NamedCsv {
    /// Opens a file, plain or gzip, or all recordings in a folder. A file that is not in the long form is read as a recording:
    /// any separator and decimal mark, a clock of another name, units in SI.
    ///
    /// # Errors
    /// It cannot be read, is no CSV file, or is a folder without any.
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

    /// The file that a table in memory would be written to; `name` is for messages.
    ///
    /// # Errors
    /// It is no CSV file.
    pub fn of_table(name: &str, csv: Vec<u8>) -> Result<Self, DataError> {
        let path = Path::new(name);
        Ok(Self::of_file(path, CsvSource::of_bytes(path, csv)?))
    }

    /// Names in the header, of a folder those of its first file.
    pub fn header(&self) -> &[String] {
        self.files.first().map_or(&[], |file| file.source.header())
    }

    /// Reads the columns `wanted`, with their units; an empty cell is a gap. A file without the column `trajectory` holds one
    /// trajectory; in a folder it is called as the file, and those of a file with several have the file's name before theirs.
    ///
    /// # Errors
    /// A column is missing, or a row cannot be read: [`DataError`] with file, line, column and remedy.
    pub fn read(self, wanted: &[(&str, Unit)]) -> Result<Dataset, DataError> {
        self.read_by(TIME, wanted)
    }

    /// Reads as [`read`](Self::read) does a file whose rows are counted by the column `clock`: times are these counts.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_by(self, clock: &str, wanted: &[(&str, Unit)]) -> Result<Dataset, DataError> {
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
    /// Trajectories of the file, with the columns `wanted`.
    fn read(self, clock: &str, wanted: &[&str]) -> Result<Vec<Trajectory>, DataError> {
        let mut source = self.source;
        let place = |name: &str| source.header().iter().position(|n| n == name);
        let (id_cell, group_cell) = (place(TRAJECTORY), place(GROUP));
        let time_cell = source.require(clock, LAYOUT)?;
        let cells = wanted.iter().map(|name| source.require(name, LAYOUT)).collect::<Result<Vec<_>, _>>()?;
        let mut rows = Assembler::new(source.path().to_owned(), TRAJECTORY, TIME, cells.len());
        let mut values = vec![0.0; cells.len()];
        while source.next_row()? {
            let text = |cell: usize| -> Result<&str, DataError> {
                let text = source.text(cell)?;
                if text.is_empty() { Err(source.empty_cell(cell, "every row needs it")) } else { Ok(text) }
            };
            let own = id_cell.map(text).transpose()?;
            let id: Cow<'_, str> = match (&self.recording, own) {
                (Some(recording), Some(own)) => format!("{recording}/{own}").into(),
                (Some(recording), None) => recording.as_str().into(),
                (None, own) => own.unwrap_or(ONLY).into(),
            };
            let group = group_cell.map(text).transpose()?;
            let missing = || source.empty_cell(time_cell, "every sample needs its time");
            let time_s = source.number(time_cell)?.ok_or_else(missing)?;
            for (value, &cell) in values.iter_mut().zip(&cells) {
                *value = source.number(cell)?.unwrap_or(f64::NAN);
            }
            rows.push(source.line(), &id, group, time_s, &values)?;
        }
        rows.finish()
    }
}

fn open_file(path: &Path) -> Result<CsvSource, DataError> {
    let bytes = read_whole(path)?;
    let strict = CsvSource::of_bytes(path, bytes.clone());
    if strict.as_ref().is_ok_and(|source| source.header().iter().any(|name| name == TIME)) {
        return strict;
    }
    match in_long_form(path, &bytes) {
        Some(bytes) => CsvSource::of_bytes(path, bytes),
        None => strict,
    }
}
