//! Mistakes in data, each with its place and remedy.

use crate::atomic_file::AtomicWriteError;
use crate::checks::suspicious::SuspiciousData;
use crate::limits::LimitExceeded;
use crate::npz_fault::ArrayFault;
use crate::printable::{printable, shown, shown_list};
use crate::push::PushError;
use crate::sniff::Unrecognised;
use crate::source::Source;
use crate::unit::Unit;
use std::fmt;
use std::path::PathBuf;
use thiserror::Error;

/// Why a column name is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ColumnError {
    /// Characters outside `[A-Za-z0-9_]`, or not starting with a letter.
    #[error(
        "column `{}`: a name is made of ASCII letters, digits and underscores, at most 256, and \
         starts with a letter; rename it",
        shown(name)
    )]
    Malformed {
        /// Name as found.
        name: String,
    },
    /// `trajectory`, `t_s` or `group` used as a numeric column.
    #[error("column `{name}`: `trajectory`, `t_s` and `group` have a meaning of their own; rename it")]
    Reserved {
        /// Name as found.
        name: String,
    },
    /// The suffix is no known unit.
    #[error(
        "column `{}`: its name ends in no known unit; convert to SI and end the name in one of \
         {}; a text label goes into a column called `group`",
        shown(name),
        Unit::accepted_suffixes()
    )]
    UnknownUnit {
        /// Name as found.
        name: String,
    },
}

/// Remedy for a row whose cells are not as many as the header's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowRemedy {
    /// Cells are missing.
    Complete,
    /// Cells are too many, and digits stand where a decimal comma would have cut a number in two.
    Points,
    /// Cells are too many.
    Shorten,
}

impl fmt::Display for RowRemedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RowRemedy::Complete => "complete the row",
            RowRemedy::Points => {
                "if decimals are written with commas, write them with points (4.5, not 4,5), otherwise remove the \
                 surplus cells"
            }
            RowRemedy::Shorten => "remove the surplus cells, or put cells that contain a comma in double quotes",
        })
    }
}

/// Remedy for a cell that is no finite number.
fn number_remedy(cell: &str) -> String {
    let pointed = cell.replacen(',', ".", 1);
    match cell.contains(',') && pointed.parse::<f64>().is_ok_and(f64::is_finite) {
        true => format!("decimals are written with a point: {}", shown(&pointed)),
        false => {
            "write a decimal such as 1.25 or -3e-4, and leave out samples that were not measured".to_owned()
        }
    }
}

/// A sentence on one line.
fn shown_text(text: &str) -> String {
    printable(text).replace('\n', " ")
}

/// Everything that reading, building, splitting, scaling or writing a data set can report.
///
/// Lines are counted from 1 and include the header; `samples` from 0.
#[derive(Debug, Error)]
pub enum DataError {
    /// The file could not be opened or read.
    #[error("{}: cannot read: {cause}; check that the path exists and may be read", path.display())]
    Unreadable {
        /// File.
        path: PathBuf,
        /// Error of the system.
        cause: std::io::Error,
    },
    /// A folder stands where a file is to be read.
    #[error(
        "{}: is a folder, and one file is read; put the recordings into one CSV file with a column `trajectory` that \
         tells them apart", path.display()
    )]
    Folder {
        /// Folder.
        path: PathBuf,
    },
    /// The gzip stream ends before its end mark.
    #[error(
        "{}: line {line}: the gzip stream ends too early; the file was cut off while copying or \
         writing: copy or make it again", path.display()
    )]
    TruncatedGzip {
        /// File.
        path: PathBuf,
        /// First line that could not be read.
        line: u64,
    },
    /// The gzip stream is damaged (bad header, bad checksum).
    #[error(
        "{}: line {line}: the gzip stream is damaged ({cause}); copy or make the file again",
        path.display()
    )]
    DamagedGzip {
        /// File.
        path: PathBuf,
        /// First line that could not be read.
        line: u64,
        /// Error of the decoder.
        cause: std::io::Error,
    },
    /// Bytes that are no gzip follow the end of the stream.
    #[error(
        "{}: {bytes} bytes that are not gzip follow the end of the gzip stream; take them off, or pack the file \
         again", path.display()
    )]
    AfterGzip {
        /// File.
        path: PathBuf,
        /// Number of bytes.
        bytes: usize,
    },
    /// More than [`Limit`](crate::Limit)s allow.
    #[error("{origin}: {cause}")]
    Limit {
        /// File, or a set made by code.
        origin: Source,
        /// Which limit.
        cause: LimitExceeded,
    },
    /// A header whose cells are separated otherwise.
    #[error(
        "{}: line 1: cells are separated by {separator:?}; save the file with commas between cells and points in \
         decimals (4.5, not 4,5)", path.display()
    )]
    OtherSeparator {
        /// File.
        path: PathBuf,
        /// Separator found.
        separator: char,
    },
    /// A file in no known layout, of which something cannot be told.
    #[error("{}: {}", path.display(), shown_text(&open.to_string()))]
    NotRecognised {
        /// File.
        path: PathBuf,
        /// The question that stays open, and the remedy.
        open: Unrecognised,
    },
    /// No bytes, or only blank lines.
    #[error(
        "{}: the file is empty; the first line must be a header such as \
         `trajectory,t_s,height_m,velocity_m_s`", path.display()
    )]
    Empty {
        /// File.
        path: PathBuf,
    },
    /// A header and nothing below it.
    #[error("{}: line 1: a header but no samples; add one row for each sample", path.display())]
    HeaderOnly {
        /// File.
        path: PathBuf,
    },
    /// The header lacks a column that the layout needs.
    #[error(
        "{}: line 1: column `{column}` is missing; the header has: {}; {layout}",
        path.display(), shown_list(available), column = shown(column))]
    MissingColumn {
        /// File.
        path: PathBuf,
        /// Name that is needed.
        column: String,
        /// Names that are there.
        available: Vec<String>,
        /// Expectation of the layout, in words.
        layout: &'static str,
    },
    /// The header has nothing besides trajectory, time and group.
    #[error(
        "{}: line 1: no column of measured values; add at least one whose name ends in its unit, \
         such as `height_m`", path.display()
    )]
    NoValueColumns {
        /// File.
        path: PathBuf,
    },
    /// A header name is refused.
    #[error("{}: line 1: {cause}", path.display())]
    BadColumn {
        /// File.
        path: PathBuf,
        /// Which and why.
        cause: ColumnError,
    },
    /// A name occurs twice in a header or in a list of columns.
    #[error("{origin}: column `{column}` occurs twice; rename or remove one of them", column = shown(column))]
    DuplicateColumn {
        /// Data set.
        origin: Source,
        /// Name.
        column: String,
    },
    /// A row with more or fewer cells than the header.
    #[error(
        "{}: line {line}: {found} cells where the header has {expected}; {remedy} (the first column is `{}`)",
        path.display(), shown(first_column)
    )]
    RaggedRow {
        /// File.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Cells in this row.
        found: usize,
        /// Cells in the header.
        expected: usize,
        /// First header name, to help find the row's shift.
        first_column: String,
        /// Depends on the cells.
        remedy: RowRemedy,
    },
    /// Bytes that are no UTF-8 text.
    #[error("{}: line {line}, column `{column}`: not UTF-8 text; save the file as UTF-8", path.display(), column = shown(column))]
    NotUtf8 {
        /// File.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Column, by name or (in the header) by number.
        column: String,
    },
    /// A cell that is no finite number.
    #[error(
        "{}: line {line}, column `{}`: `{}` is not a finite number; {}",
        path.display(), shown(column), shown(cell), number_remedy(cell)
    )]
    BadNumber {
        /// File.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Column.
        column: String,
        /// Cell as found.
        cell: String,
    },
    /// An empty cell where gaps were not asked for, or in a column that may have none.
    #[error("{}: line {line}, column `{column}`: empty cell; {remedy}", path.display(), column = shown(column))]
    EmptyCell {
        /// File.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Column.
        column: String,
        /// Depends on the column: measured values may have gaps when asked for, others never.
        remedy: &'static str,
    },
    /// Time stands still or runs backwards within a trajectory of a file.
    #[error(
        "{}: line {line}, column `{column}`: time {time_s} s after {previous_s} s in trajectory \
         `{trajectory}`; sort its rows by time and remove repeated ones", path.display(), trajectory = shown(trajectory))]
    TimeNotIncreasing {
        /// File.
        path: PathBuf,
        /// Line of the later row.
        line: u64,
        /// Column of the time.
        column: &'static str,
        /// Trajectory.
        trajectory: String,
        /// Time of the row before, s.
        previous_s: f64,
        /// Time of this row, s.
        time_s: f64,
    },
    /// Rows of one trajectory are not next to each other.
    #[error(
        "{}: line {line}, column `{column}`: trajectory `{trajectory}` appears again after it ended \
         on line {ended_line}; keep its rows together or give the second part another name",
        path.display(), trajectory = shown(trajectory))]
    TrajectoryReappears {
        /// File.
        path: PathBuf,
        /// Line of the reappearance.
        line: u64,
        /// Column of the identifier.
        column: &'static str,
        /// Trajectory.
        trajectory: String,
        /// Last line of its first part.
        ended_line: u64,
    },
    /// The label changes inside a trajectory.
    #[error(
        "{}: line {line}, column `group`: `{found}` in trajectory `{trajectory}`, which began with \
         `{expected}`; a trajectory has one group", path.display(), trajectory = shown(trajectory), found = shown(found), expected = shown(expected))]
    GroupChanges {
        /// File.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Trajectory.
        trajectory: String,
        /// Label of its first row.
        expected: String,
        /// Label of this row.
        found: String,
    },
    /// Identifier or label in a file that could not be written and read back.
    #[error(
        "{}: line {line}, column `{column}`: \"{label}\" begins or ends with a blank, contains a \
         control character or is longer than 256 bytes; rename it", path.display(), label = shown(label))]
    BadLabelInFile {
        /// File.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Column of the identifier or the group.
        column: &'static str,
        /// Label as found.
        label: String,
    },
    /// Identifier or group, given by code, that could not be written and read back.
    #[error(
        "trajectory \"{trajectory}\": identifiers and groups must not be empty, begin or end with a \
         blank, contain control characters or be longer than 256 bytes; rename it", trajectory = shown(trajectory))]
    BadLabel {
        /// Trajectory, as given.
        trajectory: String,
    },
    /// Two trajectories of the same name.
    #[error("{origin}: trajectory `{trajectory}` occurs twice; give each its own name", trajectory = shown(trajectory))]
    DuplicateTrajectory {
        /// Data set.
        origin: Source,
        /// Trajectory.
        trajectory: String,
    },
    /// Some trajectories have a group and others none.
    #[error("{origin}: trajectory `{trajectory}`: has {} group while the first trajectory has {}; \
             give all of them one or none",
             if *has_group { "a" } else { "no" }, if *has_group { "none" } else { "one" }, trajectory = shown(trajectory))]
    GroupOnSome {
        /// Data set.
        origin: Source,
        /// First trajectory that differs.
        trajectory: String,
        /// Whether that one has a group.
        has_group: bool,
    },
    /// Number of value columns differs from the data set's.
    #[error(
        "{origin}: trajectory `{trajectory}`: {found} value columns where the data set has \
         {expected}; pass one vector for each column", trajectory = shown(trajectory))]
    ColumnCount {
        /// Data set.
        origin: Source,
        /// Trajectory.
        trajectory: String,
        /// Vectors given.
        found: usize,
        /// Columns of the data set.
        expected: usize,
    },
    /// A column's length differs from the number of times.
    #[error(
        "trajectory `{trajectory}`: value column {column} has {found} samples where the time has \
         {expected}; pass one value for each time", trajectory = shown(trajectory))]
    SampleCount {
        /// Trajectory.
        trajectory: String,
        /// Index of the column.
        column: usize,
        /// Values given.
        found: usize,
        /// Times given.
        expected: usize,
    },
    /// A trajectory without samples.
    #[error("trajectory `{trajectory}`: no samples; leave it out", trajectory = shown(trajectory))]
    NoSamples {
        /// Trajectory.
        trajectory: String,
    },
    /// Time of a trajectory built by code is not finite or not increasing.
    #[error(
        "trajectory `{trajectory}`: time at sample {sample} is not finite or not after the one \
         before; times must increase strictly", trajectory = shown(trajectory))]
    BadTime {
        /// Trajectory.
        trajectory: String,
        /// Sample.
        sample: usize,
    },
    /// An infinite value in a trajectory built by code.
    #[error(
        "trajectory `{trajectory}`: value column {column} is infinite at sample {sample}; only \
         finite values, and NaN for a gap, are allowed", trajectory = shown(trajectory))]
    Infinite {
        /// Trajectory.
        trajectory: String,
        /// Index of the column.
        column: usize,
        /// Sample.
        sample: usize,
    },
    /// A name in code is refused.
    #[error(transparent)]
    Column(#[from] ColumnError),
    /// Asked for a column that is not there.
    #[error(
        "{origin}: no column `{column}`; it has: {}; rename a column or ask for one of these",
        shown_list(available), column = shown(column))]
    NoSuchColumn {
        /// Data set.
        origin: Source,
        /// Name asked for.
        column: String,
        /// Names that are there.
        available: Vec<String>,
    },
    /// A column of which nothing was measured.
    #[error("{origin}: column `{column}` has no measured value, so it has no mean; leave it out", column = shown(column))]
    AllMissing {
        /// Data set.
        origin: Source,
        /// Column.
        column: String,
    },
    /// Split sizes that cannot be had.
    #[error(
        "cannot split {trajectories} trajectories into {train} for training and {test} for \
             testing; both need at least one and together at most {trajectories}"
    )]
    BadSplit {
        /// Trajectories at hand.
        trajectories: usize,
        /// Asked for training.
        train: usize,
        /// Asked for testing.
        test: usize,
    },
    /// A fraction outside (0, 1).
    #[error("training fraction {fraction} is not between 0 and 1; use for example 0.8")]
    BadFraction {
        /// Fraction asked for.
        fraction: f64,
    },
    /// Nothing to write.
    #[error("{}: refusing to write a data set without trajectories; no reader would accept it", path.display())]
    NothingToWrite {
        /// Target.
        path: PathBuf,
    },
    /// An array of an NPZ file cannot be used.
    #[error("{}: array `{array}`: {fault}", path.display(), array = shown(array))]
    Array {
        /// File.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// The mistake, and the remedy.
        fault: ArrayFault,
    },
    /// The values cannot be what the names say.
    #[error(transparent)]
    Suspicious(#[from] SuspiciousData),
    /// A push file, or an archive, is faulty.
    #[error(transparent)]
    Push(#[from] PushError),
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
}
