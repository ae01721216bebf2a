//! Reads the columns of CSV files that a model names, with the units of the model.

use crate::assemble::Assembler;
use crate::column::{Column, GROUP, TIME, TRAJECTORY};
use crate::csv_long::MissingCells;
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::{DataError, EVERY_SAMPLE_NEEDS_A_TIME};
use crate::escape_control_characters::escaped_list;
use crate::foreign::content;
use crate::sniff::Unrecognised;
use crate::sniff::{LongForm, NamedUnit, files_in, in_long_form, names_trajectories, stem, units_of_header};
use crate::source::Source;
use crate::statistics::digits;
use crate::trajectory::Trajectory;
use crate::unit::{FileUnit, Unit};
use crate::whole_file::read_whole;
use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

const LAYOUT: &str = "the long form is comma-separated and has the sample times in the column `t_s`; name another time \
                      column with --time COLUMN:UNIT";

/// What a file contains that has a column of groups, for messages.
const GROUP_LAYOUT: &str = "a column with the group of each trajectory, as --group-by names it";
/// Identifier of the only trajectory of a file without the column `trajectory`.
const SINGLE_ID: &str = "1";

/// A CSV file whose header was read, or a folder of such files with one recording each.
pub struct NamedCsv {
    path: PathBuf,
    /// Opened files, at least one; those of a folder are sorted by name.
    files: Vec<NamedFile>,
    /// Whether each trajectory is a group of its own.
    is_each_a_group: bool,
}

/// One CSV file of a [`NamedCsv`], with its header read.
struct NamedFile {
    /// Name of the recording; `None` where a single file was opened.
    recording: Option<String>,
    source: CsvSource,
    /// Unit of each column; `None` where the header states none.
    units: Vec<Option<NamedUnit>>,
    /// Assumptions about the time column and its unit, one sentence each.
    notes: Vec<String>,
}

impl fmt::Debug for NamedCsv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NamedCsv").field("path", &self.path).finish_non_exhaustive()
    }
}

impl NamedCsv {
    /// Opens a file, plain or gzip, or all recordings in a folder.
    ///
    /// A file that is not in the long form may have any separator and decimal mark, another name and unit of
    /// the time column. Columns whose names state a unit are converted to SI.
    ///
    /// # Errors
    /// The file cannot be read or is not CSV, or the folder has no recordings.
    pub fn open(path: &Path) -> Result<Self, DataError> {
        Self::open_with_time(path, None)
    }

    /// Like [`open`](Self::open), with the time column that a user names, such as `clock:ms`.
    ///
    /// # Errors
    /// The errors of [`open`](Self::open); or there is no such column or unit.
    pub fn open_with_time(path: &Path, time: Option<&str>) -> Result<Self, DataError> {
        if !path.is_dir() {
            return Ok(Self::of_files(path, vec![open_file(path, None, time)?]));
        }
        let files = files_in(path)?.into_iter().map(|file| open_file(&file, Some(stem(&file)), time));
        Ok(Self::of_files(path, files.collect::<Result<_, _>>()?))
    }

    /// Opens several files or folders as one set of recordings, each with the name of its file.
    ///
    /// # Errors
    /// The errors of [`open_with_time`](Self::open_with_time).
    pub fn open_files(paths: &[PathBuf], time: Option<&str>) -> Result<Self, DataError> {
        let mut files = Vec::new();
        for path in paths {
            let inner = if path.is_dir() { files_in(path)? } else { vec![path.clone()] };
            for file in inner {
                files.push(open_file(&file, Some(stem(&file)), time)?);
            }
        }
        Ok(Self::of_files(paths.first().map_or(Path::new(""), PathBuf::as_path), files))
    }

    /// Opens a CSV text in memory; `name` stands for the file name in messages.
    ///
    /// # Errors
    /// The text is not CSV.
    pub fn from_csv(name: &str, csv: Vec<u8>) -> Result<Self, DataError> {
        let path = Path::new(name);
        let file = NamedFile::of_long_form(CsvSource::from_bytes(path, csv)?, None);
        Ok(Self::of_files(path, vec![file]))
    }

    fn of_files(path: &Path, files: Vec<NamedFile>) -> Self {
        Self { path: path.to_owned(), files, is_each_a_group: false }
    }

    /// Takes the groups of the trajectories from the column `column`, whose labels are text or numbers. With the column
    /// `trajectory` each trajectory is a group of its own, also where each file is one.
    ///
    /// # Errors
    /// A file has no such column.
    pub fn with_groups(mut self, column: &str) -> Result<Self, DataError> {
        if column == TRAJECTORY {
            self.is_each_a_group = true;
            return Ok(self);
        }
        for file in &mut self.files {
            file.source.use_column_as(column, GROUP, GROUP_LAYOUT)?;
        }
        Ok(self)
    }

    /// Column names in the header; for a folder, those of its first file.
    pub fn header(&self) -> &[String] {
        self.files.first().map_or(&[], |file| file.source.header())
    }

    /// Whether the file has a column of the quantity `name`, in any unit that converts to `unit`.
    ///
    /// For a folder its first file is searched.
    pub fn has_column(&self, name: &str, unit: Option<Unit>) -> bool {
        self.files.first().is_some_and(|file| file.cell(name, unit.unwrap_or(Unit::DIMENSIONLESS)).is_some())
    }

    /// Names of the columns that hold none of the quantities `wanted`.
    pub fn other_columns(&self, wanted: &[(&str, Unit)]) -> Vec<String> {
        let Some(file) = self.files.first() else { return Vec::new() };
        let used: Vec<usize> =
            wanted.iter().filter_map(|(name, unit)| Some(file.cell(name, *unit)?.0)).collect();
        let header = file.source.header().iter().enumerate();
        header.filter(|(cell, _)| !used.contains(cell)).map(|(_, name)| name.clone()).collect()
    }

    /// Assumptions about the time column, and unit conversions of the columns `wanted`, one sentence each.
    pub fn notes(&self, wanted: &[(&str, Unit)]) -> Vec<String> {
        self.files.first().map_or_else(Vec::new, |file| file.notes(wanted))
    }

    /// Reads the columns `wanted` with their units; an empty cell is a gap.
    ///
    /// A column of the file matches by its whole name, or by its name without the unit where its unit converts
    /// to that of the quantity; its values are converted. The notes of the data set state each conversion.
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
        let notes = self.notes(wanted);
        let mut trajectories = Vec::new();
        for file in self.files {
            trajectories.extend(file.read(clock, wanted)?);
        }
        if self.is_each_a_group {
            trajectories =
                trajectories.into_iter().map(Trajectory::in_own_group).collect::<Result<_, _>>()?;
        }
        Ok(Dataset::with_origin(columns, trajectories, Source::File(self.path))?.with_notes(notes))
    }
}

impl NamedFile {
    /// Creates the entry of a file in the long form, with the units that its header states.
    fn of_long_form(source: CsvSource, recording: Option<String>) -> Self {
        let units = units_of_header(source.header());
        NamedFile { recording, source, units, notes: Vec::new() }
    }

    /// Index of the column of a quantity, and its conversion to SI; `None` if there is no unique column.
    ///
    /// The conversion is `None` for a column in SI units.
    fn cell(&self, name: &str, unit: Unit) -> Option<(usize, Option<FileUnit>)> {
        let header = self.source.header();
        let converts = |cell: usize| {
            let file = self.units.get(cell)?.as_ref()?;
            let is_same = file.conversion.unit().dimensions() == unit.dimensions();
            (is_same && !file.conversion.is_si()).then_some(file.conversion)
        };
        if let Some(cell) = header.iter().position(|h| h == name) {
            // The name says `deg` itself where the model calls the quantity so; only a row of units adds to it.
            let says_unit =
                self.units.get(cell).and_then(Option::as_ref).is_some_and(|u| u.base != name.to_lowercase());
            return Some((cell, converts(cell).filter(|_| !says_unit)));
        }
        let is_wanted = |file: &NamedUnit| {
            let is_same = file.conversion.unit().dimensions() == unit.dimensions();
            let base = name
                .rsplit_once('_')
                .filter(|(_, last)| Unit::is_dimensionless_word(last))
                .map_or(name, |n| n.0);
            file.si_name.eq_ignore_ascii_case(name)
                || is_same
                    && (file.base == name.to_lowercase()
                        || unit == Unit::DIMENSIONLESS && file.base == base.to_lowercase())
        };
        let mut found =
            self.units.iter().enumerate().filter(|(_, file)| file.as_ref().is_some_and(is_wanted));
        let (cell, file) = found.next()?;
        let conversion = file.as_ref().map(|file| file.conversion).filter(|c| !c.is_si());
        found.next().is_none().then_some((cell, conversion))
    }

    /// Assumptions about the time column, and unit conversions of the columns `wanted`, one sentence each.
    fn notes(&self, wanted: &[(&str, Unit)]) -> Vec<String> {
        let mut notes = self.notes.clone();
        for (name, unit) in wanted {
            let Some((cell, Some(c))) = self.cell(name, *unit) else { continue };
            let from = escaped_list(&self.source.header()[cell..=cell]);
            let offset =
                if c.offset() == 0.0 { String::new() } else { format!(" plus {}", digits(c.offset())) };
            notes.push(format!("{from} times {}{offset} is {name}", digits(c.factor())));
        }
        notes
    }

    /// Reads the trajectories of the file with the columns `wanted`.
    fn read(self, clock: &str, wanted: &[(&str, Unit)]) -> Result<Vec<Trajectory>, DataError> {
        let found: Vec<_> = wanted.iter().map(|(name, unit)| self.cell(name, *unit)).collect();
        let mut source = self.source;
        let position = |name: &str| source.header().iter().position(|n| n == name);
        let (id_cell, group_cell) = (position(TRAJECTORY), position(GROUP));
        let time_cell = source.require(clock, LAYOUT)?;
        let cells = found.into_iter().zip(wanted).map(|(found, (name, _))| match found {
            Some(cell) => Ok(cell),
            None => source.require(name, LAYOUT).map(|cell| (cell, None)),
        });
        let cells = cells.collect::<Result<Vec<_>, _>>()?;
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
            for (value, &(cell, conversion)) in values.iter_mut().zip(&cells) {
                let number = source.number(cell)?.unwrap_or(f64::NAN);
                *value = conversion.map_or(number, |c| c.to_si(number));
            }
            rows.push(source.line(), &id, group, time_s, &values)?;
        }
        rows.finish()
    }
}

/// Opens a file in the long form, or in another layout whose time column can be inferred.
fn open_file(path: &Path, recording: Option<String>, time: Option<&str>) -> Result<NamedFile, DataError> {
    let bytes = content(path, read_whole(path)?, MissingCells::AsGap)?.into_text();
    let strict = CsvSource::from_bytes(path, bytes.clone());
    // A file in the long form has its trajectories in the column of that name, and not in one called `run`.
    let is_long_form = strict.as_ref().is_ok_and(|source| {
        let has = |column: &str| source.header().iter().any(|name| name == column);
        has(TIME) && (has(TRAJECTORY) || !source.header().iter().any(|name| names_trajectories(name)))
    });
    if is_long_form && time.is_none() {
        return Ok(NamedFile::of_long_form(strict?, recording));
    }
    match in_long_form(path, &bytes, time)? {
        Some(LongForm { csv, units, notes }) => {
            Ok(NamedFile { recording, source: CsvSource::from_bytes(path, csv)?, units, notes })
        }
        None => {
            let source = strict?;
            // Without a header, the first row would be told as the names of the columns.
            let is_header = |name: &String| name.parse::<f64>().is_err() && !name.starts_with(['#', '%']);
            match source.header().first().is_none_or(is_header) {
                true => Ok(NamedFile::of_long_form(source, recording)),
                false => {
                    let columns = source.header().to_vec();
                    Err(DataError::NotRecognised {
                        path: path.to_owned(),
                        reason: Unrecognised::NoTimes { columns },
                    })
                }
            }
        }
    }
}
