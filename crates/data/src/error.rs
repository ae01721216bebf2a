//! Errors in data files and data sets: each message says what is wrong, where, and what to do.

use crate::atomic_file::AtomicWriteError;
use crate::checks::suspicious::SuspiciousData;
use crate::escape_control_characters::{escape_control_characters, escaped_list, escaped_short};
use crate::limits::LimitExceeded;
use crate::npz_fault::ArrayFault;
use crate::push::PushError;
use crate::sniff::Unrecognised;
use crate::source::Source;
use crate::unit::Unit;
use std::fmt;
use std::path::PathBuf;
use thiserror::Error;

/// Reason why a column name is not accepted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ColumnError {
    /// The name has characters outside `[A-Za-z0-9_]`, does not start with a letter, or is too long.
    #[error(
        "column `{}`: a column name may hold only ASCII letters, digits and underscores, must start with a \
         letter and be at most 256 characters long; rename it",
        escaped_short(name)
    )]
    Malformed {
        /// Column name that is not accepted.
        name: String,
    },
    /// A reserved name (`trajectory`, `t_s` or `group`) is used for a numeric column.
    #[error("column `{name}`: the names `trajectory`, `t_s` and `group` are reserved; rename it")]
    Reserved {
        /// Column name that is not accepted.
        name: String,
    },
    /// The name does not end in a known unit.
    #[error(
        "column `{}`: the name does not end in a known unit; convert the values to SI and end the name in one \
         of {}; put text labels into a column called `group`",
        escaped_short(name),
        Unit::accepted_suffixes()
    )]
    UnknownUnit {
        /// Column name that is not accepted.
        name: String,
    },
}

/// Remedy for a row that has fewer or more cells than the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowRemedy {
    /// Complete the row, which has too few cells.
    Complete,
    /// Write decimals with points: the row has too many cells, as if decimal commas had cut numbers in two.
    Points,
    /// Remove extra cells, or quote cells with commas: the row has too many cells.
    Shorten,
}

impl fmt::Display for RowRemedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RowRemedy::Complete => "complete the row",
            RowRemedy::Points => {
                "if decimals are written with commas, write them with points (4.5, not 4,5); otherwise remove \
                 the extra cells"
            }
            RowRemedy::Shorten => "remove the extra cells, or put cells that contain a comma in double quotes",
        })
    }
}

/// Remedy for a cell that is not a finite number.
fn number_remedy(cell: &str) -> String {
    let pointed = cell.replacen(',', ".", 1);
    match cell.contains(',') && pointed.parse::<f64>().is_ok_and(f64::is_finite) {
        true => format!("write decimals with a point: {}", escaped_short(&pointed)),
        false => {
            "write a decimal such as 1.25 or -3e-4, and leave out samples that were not measured".to_owned()
        }
    }
}

/// Remedy of [`DataError::EmptyCell`] in a column of identifiers or groups.
pub(crate) const EVERY_ROW_NEEDS_A_VALUE: &str = "every row needs a value in this column";
/// Remedy of [`DataError::EmptyCell`] in the time column.
pub(crate) const EVERY_SAMPLE_NEEDS_A_TIME: &str = "every sample needs a time";
/// Remedy of [`DataError::EmptyCell`] in a column of measured values that must not have gaps.
pub(crate) const EVERY_VALUE_IS_NEEDED: &str =
    "every value is needed here: fill it in, or remove the row or the trajectory";
/// Remedy of [`DataError::EmptyCell`] in a file of a layout without gaps.
pub(crate) const NO_EMPTY_CELLS: &str =
    "this layout does not allow empty cells; fill it in, or remove the row";

/// Reason why a file cannot be read, and the remedy.
pub fn unreadable_text(cause: &std::io::Error) -> String {
    match cause.kind() {
        std::io::ErrorKind::NotFound => "there is no such file or folder; check the path".to_owned(),
        _ => format!("cannot read: {cause}; check that the path exists and may be read"),
    }
}

/// Prepares a message text: on one line, with control characters escaped.
fn shown_text(text: &str) -> String {
    escape_control_characters(text).replace('\n', " ")
}

/// Errors of reading, building, splitting, scaling and writing a data set.
///
/// Lines are counted from 1 and include the header; samples are counted from 0.
#[derive(Debug, Error)]
pub enum DataError {
    /// The file could not be opened or read.
    #[error("{}: {}", path.display(), unreadable_text(cause))]
    Unreadable {
        /// Path of the data file.
        path: PathBuf,
        /// Error of the operating system.
        cause: std::io::Error,
    },
    /// The path is a folder, but a single file is expected.
    #[error(
        "{}: is a folder, but a single file is expected; put the recordings into one CSV file with a column \
         `trajectory` that identifies each of them", path.display()
    )]
    Folder {
        /// Path of the folder.
        path: PathBuf,
    },
    /// The gzip stream ends before its end mark.
    #[error(
        "{}: line {line}: the gzip stream ends too early; the file was cut off while copying or \
         writing: copy or make it again", path.display()
    )]
    TruncatedGzip {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the first line that could not be read.
        line: u64,
    },
    /// The gzip stream is damaged (bad header, bad checksum).
    #[error(
        "{}: line {line}: the gzip stream is damaged ({cause}); copy or make the file again",
        path.display()
    )]
    DamagedGzip {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the first line that could not be read.
        line: u64,
        /// Error of the gzip decoder.
        cause: std::io::Error,
    },
    /// Bytes of another kind follow the end of the gzip stream.
    #[error(
        "{}: {bytes} bytes that are not gzip follow the end of the gzip stream; remove them, or compress the \
         file again", path.display()
    )]
    TrailingBytes {
        /// Path of the data file.
        path: PathBuf,
        /// Number of bytes after the end of the gzip stream.
        bytes: usize,
    },
    /// The file or the data set exceeds a [`Limit`](crate::Limit).
    #[error("{origin}: {cause}")]
    Limit {
        /// File that exceeds the limit, or a data set built by code.
        origin: Source,
        /// Limit that was exceeded, with its value.
        cause: LimitExceeded,
    },
    /// The cells of the header are not separated by commas.
    #[error(
        "{}: line 1: cells are separated by {separator:?}; save the file with commas between cells and points in \
         decimals (4.5, not 4,5)", path.display()
    )]
    UnexpectedSeparator {
        /// Path of the data file.
        path: PathBuf,
        /// Character that separates the cells of the header.
        separator: char,
    },
    /// The file has no known layout, and the reader cannot infer how to read it.
    #[error("{}: {}", path.display(), shown_text(&reason.to_string()))]
    NotRecognised {
        /// Path of the data file.
        path: PathBuf,
        /// Property of the layout that could not be inferred, with the remedy.
        reason: Unrecognised,
    },
    /// The file has no bytes, or only blank lines.
    #[error(
        "{}: the file is empty; the first line must be a header such as \
         `trajectory,t_s,height_m,velocity_m_s`", path.display()
    )]
    Empty {
        /// Path of the data file.
        path: PathBuf,
    },
    /// The file has a header and no rows.
    #[error("{}: line 1: the file has a header but no samples; add one row for each sample", path.display())]
    HeaderOnly {
        /// Path of the data file.
        path: PathBuf,
    },
    /// The header lacks a column that the layout needs.
    #[error(
        "{}: line 1: column `{column}` is missing; the header has: {}; {layout}",
        path.display(), escaped_list(available), column = escaped_short(column))]
    MissingColumn {
        /// Path of the data file.
        path: PathBuf,
        /// Name of the column that is missing.
        column: String,
        /// Column names in the header.
        available: Vec<String>,
        /// Description of the expected layout.
        layout: &'static str,
    },
    /// The header has no columns other than trajectory, time and group.
    #[error(
        "{}: line 1: there is no column of measured values; add at least one whose name ends in its unit, \
         such as `height_m`", path.display()
    )]
    NoValueColumns {
        /// Path of the data file.
        path: PathBuf,
    },
    /// A name in the header is not accepted.
    #[error("{}: line 1: {cause}", path.display())]
    BadColumn {
        /// Path of the data file.
        path: PathBuf,
        /// Column name that is not accepted, and the reason.
        cause: ColumnError,
    },
    /// A column name occurs twice in a header or in a list of columns.
    #[error("{origin}: column `{column}` occurs twice; rename or remove one of them", column = escaped_short(column))]
    DuplicateColumn {
        /// File from which the data set was read, or code that built it.
        origin: Source,
        /// Name that occurs twice.
        column: String,
    },
    /// A row has more or fewer cells than the header.
    #[error(
        "{}: line {line}: the row has {found} cells but the header has {expected}; {remedy} (the first column is `{}`)",
        path.display(), escaped_short(first_column)
    )]
    RaggedRow {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: u64,
        /// Number of cells in the faulty row.
        found: usize,
        /// Number of cells in the header.
        expected: usize,
        /// First header name, which helps to find the shift of the row.
        first_column: String,
        /// What to do about the row, which depends on its cells.
        remedy: RowRemedy,
    },
    /// The bytes are not UTF-8 text.
    #[error("{}: line {line}, column `{column}`: not UTF-8 text; save the file as UTF-8", path.display(), column = escaped_short(column))]
    NotUtf8 {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: u64,
        /// Column of the cell: its name or, in the header, its number.
        column: String,
    },
    /// A cell is not a finite number.
    #[error(
        "{}: line {line}, column `{}`: `{}` is not a finite number; {}",
        path.display(), escaped_short(column), escaped_short(cell), number_remedy(cell)
    )]
    BadNumber {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: u64,
        /// Name of the column of the cell.
        column: String,
        /// Text of the cell that is not a finite number.
        cell: String,
    },
    /// A cell is empty where no gaps are allowed.
    #[error("{}: line {line}, column `{column}`: empty cell; {remedy}", path.display(), column = escaped_short(column))]
    EmptyCell {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: u64,
        /// Name of the column of the empty cell.
        column: String,
        /// What to do about the empty cell, which depends on the column.
        ///
        /// Only measured values may have gaps, and only on request.
        remedy: &'static str,
    },
    /// The time does not increase within a trajectory of a file.
    #[error(
        "{}: line {line}, column `{column}`: the time of trajectory `{trajectory}` does not increase ({time_s} s \
         follows {previous_s} s); sort its rows by time and remove repeated times",
        path.display(), trajectory = escaped_short(trajectory))]
    TimeNotIncreasing {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the line with the time that does not increase.
        line: u64,
        /// Name of the time column.
        column: &'static str,
        /// Identifier of the trajectory.
        trajectory: String,
        /// Time in the row before, s.
        previous_s: f64,
        /// Time in the row that does not increase, s.
        time_s: f64,
    },
    /// The rows of a trajectory are not contiguous.
    #[error(
        "{}: line {line}, column `{column}`: trajectory `{trajectory}` appears again after it ended \
         on line {ended_line}; keep its rows together or give the second part another name",
        path.display(), trajectory = escaped_short(trajectory))]
    TrajectoryReappears {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the line on which the trajectory appears again.
        line: u64,
        /// Name of the column of trajectory identifiers.
        column: &'static str,
        /// Identifier of the trajectory.
        trajectory: String,
        /// Number of the last line of the trajectory's first part.
        ended_line: u64,
    },
    /// The group changes within a trajectory.
    #[error(
        "{}: line {line}, column `group`: the group of trajectory `{trajectory}` changes from `{expected}` to \
         `{found}`; give all rows of a trajectory the same group", path.display(), trajectory = escaped_short(trajectory),
        found = escaped_short(found), expected = escaped_short(expected))]
    GroupChanges {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: u64,
        /// Identifier of the trajectory.
        trajectory: String,
        /// Group in the first row of the trajectory.
        expected: String,
        /// Different group in the faulty row.
        found: String,
    },
    /// An identifier or a group in a file would not survive writing and reading back.
    #[error(
        "{}: line {line}, column `{column}`: \"{label}\" begins or ends with a space, contains a \
         control character or is longer than 256 bytes; rename it", path.display(), label = escaped_short(label))]
    BadLabelInFile {
        /// Path of the data file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: u64,
        /// Name of the column that holds the identifier or the group.
        column: &'static str,
        /// Identifier or group as it is in the file.
        label: String,
    },
    /// An identifier or a group given by code would not survive writing and reading back.
    #[error(
        "trajectory \"{trajectory}\": identifiers and groups must not be empty, begin or end with a \
         space, contain control characters or be longer than 256 bytes; rename it", trajectory = escaped_short(trajectory))]
    BadLabel {
        /// Identifier of the trajectory, as given.
        trajectory: String,
    },
    /// Two trajectories have the same name.
    #[error("{origin}: trajectory `{trajectory}` occurs twice; give each trajectory a different name", trajectory = escaped_short(trajectory))]
    DuplicateTrajectory {
        /// File from which the data set was read, or code that built it.
        origin: Source,
        /// Identifier of the trajectory.
        trajectory: String,
    },
    /// Some trajectories have a group and others do not.
    #[error("{origin}: trajectory `{trajectory}` has {} group but the first trajectory has {}; \
             give a group to all trajectories or to none",
             if *has_group { "a" } else { "no" }, if *has_group { "none" } else { "one" }, trajectory = escaped_short(trajectory))]
    PartialGroups {
        /// File from which the data set was read, or code that built it.
        origin: Source,
        /// Identifier of the first trajectory that differs from the first one of the set.
        trajectory: String,
        /// Whether the trajectory that differs has a group.
        has_group: bool,
    },
    /// A trajectory does not have one value vector per column of the data set.
    #[error(
        "{origin}: trajectory `{trajectory}` has {found} value columns but the data set has \
         {expected}; pass one vector for each column", trajectory = escaped_short(trajectory))]
    ColumnCount {
        /// File from which the data set was read, or code that built it.
        origin: Source,
        /// Identifier of the trajectory.
        trajectory: String,
        /// Number of value vectors of the trajectory.
        found: usize,
        /// Number of columns of the data set.
        expected: usize,
    },
    /// A column and the time have different numbers of samples.
    #[error(
        "trajectory `{trajectory}`: value column {column} has {found} samples but there are {expected} times; \
         pass one value for each time", trajectory = escaped_short(trajectory))]
    SampleCount {
        /// Identifier of the trajectory.
        trajectory: String,
        /// Index of the value column with the wrong number of samples.
        column: usize,
        /// Number of values in the column.
        found: usize,
        /// Number of sample times of the trajectory.
        expected: usize,
    },
    /// A trajectory has no samples.
    #[error("trajectory `{trajectory}` has no samples; leave it out", trajectory = escaped_short(trajectory))]
    NoSamples {
        /// Identifier of the trajectory.
        trajectory: String,
    },
    /// A time of a trajectory built by code is not finite or does not increase.
    #[error(
        "trajectory `{trajectory}`: the time of sample {sample} is not finite or not greater than the one \
         before; times must increase strictly", trajectory = escaped_short(trajectory))]
    BadTime {
        /// Identifier of the trajectory.
        trajectory: String,
        /// Index of the sample with the faulty time, from 0.
        sample: usize,
    },
    /// A value of a trajectory built by code is infinite.
    #[error(
        "trajectory `{trajectory}`: value column {column} is infinite at sample {sample}; only \
         finite values, and NaN for a gap, are allowed", trajectory = escaped_short(trajectory))]
    Infinite {
        /// Identifier of the trajectory.
        trajectory: String,
        /// Index of the value column with the infinite value.
        column: usize,
        /// Index of the sample with the infinite value, from 0.
        sample: usize,
    },
    /// A column name given by code is not accepted.
    #[error(transparent)]
    Column(#[from] ColumnError),
    /// The requested column does not exist.
    #[error(
        "{origin}: there is no column `{column}`; the columns are: {}; rename a column or use one of these",
        escaped_list(available), column = escaped_short(column))]
    NoSuchColumn {
        /// File from which the data set was read, or code that built it.
        origin: Source,
        /// Name of the requested column.
        column: String,
        /// Names of the columns of the data set.
        available: Vec<String>,
    },
    /// A column has no measured value.
    #[error("{origin}: column `{column}` has no measured values, so it cannot be scaled; leave it out", column = escaped_short(column))]
    NoMeasuredValues {
        /// File from which the data set was read, or code that built it.
        origin: Source,
        /// Name of the column without measured values.
        column: String,
    },
    /// The sizes of the split are zero or exceed the number of trajectories.
    #[error(
        "cannot split {trajectories} trajectories into {train} for training and {test} for testing; \
         use at least one for each and at most {trajectories} together"
    )]
    BadSplit {
        /// Number of trajectories of the data set.
        trajectories: usize,
        /// Number of trajectories requested for training.
        train: usize,
        /// Number of trajectories requested for testing.
        test: usize,
    },
    /// The training fraction is outside (0, 1).
    #[error("training fraction {fraction} is not between 0 and 1; use for example 0.8")]
    BadFraction {
        /// Requested share of the trajectories for training.
        fraction: f64,
    },
    /// The data set to write has no trajectories.
    #[error("{}: a data set without trajectories is not written, because no reader would accept it; keep at least one", path.display())]
    NothingToWrite {
        /// Path of the target file.
        path: PathBuf,
    },
    /// An array of an NPZ file cannot be used.
    #[error("{}: array `{array}`: {fault}", path.display(), array = escaped_short(array))]
    Array {
        /// Path of the data file.
        path: PathBuf,
        /// Name of the array that cannot be used.
        array: String,
        /// Fault of the array, with the remedy.
        fault: ArrayFault,
    },
    /// The values contradict the names or the units of the columns.
    #[error(transparent)]
    Suspicious(#[from] SuspiciousData),
    /// A file of measured pushes, or an archive of them, is faulty.
    #[error(transparent)]
    Push(#[from] PushError),
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
}
