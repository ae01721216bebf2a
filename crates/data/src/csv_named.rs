//! CSV in long form of which a model names some columns: their units are the model's, and the others are left alone.

use crate::assemble::Assembler;
use crate::column::{Column, GROUP, TIME, TRAJECTORY};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::sniff::in_long_form;
use crate::source::Source;
use crate::unit::Unit;
use crate::whole_file::read_whole;
use std::fmt;
use std::path::Path;

const LAYOUT: &str = "the long form is comma-separated and has the times of its rows in `t_s`";

/// Identifier of the one trajectory of a file without the column `trajectory`.
const ONLY: &str = "1";

/// A CSV file whose header was read.
pub struct NamedCsv {
    source: CsvSource,
}

impl fmt::Debug for NamedCsv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NamedCsv").field("path", &self.source.path()).finish_non_exhaustive()
    }
}

impl NamedCsv {
    /// Opens a file, plain or gzip. One that is not in the long form is read as a recording: any separator and decimal mark,
    /// a clock of another name, units in SI.
    ///
    /// # Errors
    /// It cannot be read, or is no CSV file.
    pub fn open(path: &Path) -> Result<Self, DataError> {
        let bytes = read_whole(path)?;
        let strict = CsvSource::of_bytes(path, bytes.clone());
        if strict.as_ref().is_ok_and(|source| source.header().iter().any(|name| name == TIME)) {
            return strict.map(|source| Self { source });
        }
        match in_long_form(path, &bytes) {
            Some(bytes) => Ok(Self { source: CsvSource::of_bytes(path, bytes)? }),
            None => strict.map(|source| Self { source }),
        }
    }

    /// The file that a table in memory would be written to; `name` is for messages.
    ///
    /// # Errors
    /// It is no CSV file.
    pub fn of_table(name: &str, csv: Vec<u8>) -> Result<Self, DataError> {
        Ok(Self { source: CsvSource::of_bytes(Path::new(name), csv)? })
    }

    /// Names in the header.
    pub fn header(&self) -> &[String] {
        self.source.header()
    }

    /// Reads the columns `wanted`, with their units; an empty cell is a gap. A file without the column `trajectory` holds one.
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
        let mut source = self.source;
        let path = source.path().to_owned();
        let place = |name: &str| source.header().iter().position(|n| n == name);
        let (id_cell, group_cell) = (place(TRAJECTORY), place(GROUP));
        let time_cell = source.require(clock, LAYOUT)?;
        let mut columns = Vec::with_capacity(wanted.len());
        let mut cells = Vec::with_capacity(wanted.len());
        for (name, unit) in wanted {
            cells.push(source.require(name, LAYOUT)?);
            let bad = |cause| DataError::BadColumn { path: path.clone(), cause };
            columns.push(Column::with_unit(name, *unit).map_err(bad)?);
        }
        if columns.is_empty() {
            return Err(DataError::NoValueColumns { path });
        }
        let mut rows = Assembler::new(path.clone(), TRAJECTORY, TIME, columns.len());
        let mut values = vec![0.0; columns.len()];
        while source.next_row()? {
            let text = |cell: usize| -> Result<&str, DataError> {
                let text = source.text(cell)?;
                if text.is_empty() { Err(source.empty_cell(cell, "every row needs it")) } else { Ok(text) }
            };
            let id = id_cell.map_or(Ok(ONLY), text)?;
            let group = group_cell.map(text).transpose()?;
            let missing = || source.empty_cell(time_cell, "every sample needs its time");
            let time_s = source.number(time_cell)?.ok_or_else(missing)?;
            for (value, &cell) in values.iter_mut().zip(&cells) {
                *value = source.number(cell)?.unwrap_or(f64::NAN);
            }
            rows.push(source.line(), id, group, time_s, &values)?;
        }
        Dataset::with_origin(columns, rows.finish()?, Source::File(path))
    }
}
