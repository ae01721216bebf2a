//! Mistakes in the files of the push sets, each with file, key and remedy.

use super::fault::{FilePart, NameFault, StreamLayout};
use crate::limits::LimitExceeded;
use crate::printable::{shown, shown_cause, shown_list};
use std::path::PathBuf;
use thiserror::Error;

const NAME_LAYOUT: &str = "names are `motion_surface=abs_shape=rect1_a=0_v=20_i=0.000_s=0.700_t=0.000`, with \
                           `_rep=0004` for repeats, or `block=steel_run=01`; rename the file or take it out";

/// A push file, or a set of them, that cannot be read.
#[derive(Debug, Error)]
pub enum PushError {
    /// A field of the file name holds what no table knows.
    #[error(
        "{}: file name: unknown {field} `{value}`; known are {}; correct the name or take the file out",
        path.display(), known.join(", "), value = shown(value))]
    UnknownName {
        /// File.
        path: PathBuf,
        /// `surface`, `shape` or `block`.
        field: &'static str,
        /// Value as found.
        value: String,
        /// Values that are known.
        known: Vec<&'static str>,
    },
    /// A file name of another pattern, or a field that is missing or no number.
    #[error("{}: file name: {fault}; {NAME_LAYOUT}", path.display())]
    Name {
        /// File.
        path: PathBuf,
        /// The field, and what is wrong with it.
        fault: NameFault,
    },
    /// Neither HDF5, JSON nor a zip archive.
    #[error(
        "{}: neither HDF5, JSON nor a zip archive of them, judged by its first bytes; copy or download it \
         again", path.display()
    )]
    UnknownContent {
        /// File.
        path: PathBuf,
    },
    /// The HDF5 file, or one data set in it, cannot be decoded.
    #[error("{}: `{key}`: the HDF5 file is damaged or cut off ({cause}); copy or download it again", path.display(), key = shown(key), cause = shown_cause(cause))]
    Hdf5 {
        /// File.
        path: PathBuf,
        /// Data set, or `/` for the file as a whole.
        key: String,
        /// Error of the decoder.
        cause: Box<hdf5_reader::error::Error>,
    },
    /// The JSON text is no JSON, or is cut off.
    #[error("{}: not valid JSON ({cause}); the file is damaged or cut off: copy or download it again", path.display(), cause = shown_cause(cause))]
    Json {
        /// File.
        path: PathBuf,
        /// Error of the parser, with line and column.
        cause: serde_json::Error,
    },
    /// One of the streams is not there.
    #[error(
        "{}: stream `{key}` is missing; the file has: {}; a trial needs tip_pose, object_pose and ft_wrench: \
         copy or download it again, or take it out", path.display(), shown_list(found)
    )]
    MissingStream {
        /// File.
        path: PathBuf,
        /// Stream.
        key: &'static str,
        /// Names that are there.
        found: Vec<String>,
    },
    /// A stream is not a table of four columns of 64-bit floating-point numbers.
    #[error("{}: stream `{key}`: {found}; store it as rows of four numbers: time and three values", path.display())]
    Layout {
        /// File.
        path: PathBuf,
        /// Stream.
        key: &'static str,
        /// The layout that is there instead.
        found: StreamLayout,
    },
    /// A value that is no finite number.
    #[error("{}: stream `{key}`, row {row}: a value is not a finite number; remove the row", path.display(), key = shown(key))]
    NotFinite {
        /// File.
        path: PathBuf,
        /// Stream.
        key: String,
        /// Row, from 0.
        row: usize,
    },
    /// Time runs backwards.
    #[error(
        "{}: stream `{key}`, row {row}: time {time_s} s after {previous_s} s; sort the rows by time, or take \
         the trial out if its clock was reset", path.display()
    )]
    TimeDecreases {
        /// File.
        path: PathBuf,
        /// Stream.
        key: &'static str,
        /// Row, from 0.
        row: usize,
        /// Time of the row before, s.
        previous_s: f64,
        /// Time of this row, s.
        time_s: f64,
    },
    /// Fewer than two usable samples.
    #[error("{}: stream `{key}`: fewer than two samples at different times; take the trial out", path.display())]
    TooShort {
        /// File.
        path: PathBuf,
        /// Stream.
        key: &'static str,
    },
    /// No instant at which all streams were measured.
    #[error(
        "{}: tip_pose, object_pose and ft_wrench have no time in common; check that their clocks are the same, \
         or take the trial out", path.display()
    )]
    NoCommonTime {
        /// File.
        path: PathBuf,
    },
    /// A zip archive, or a member of it, cannot be unpacked.
    #[error("{}: {}the zip archive is damaged or cut off ({cause}); copy or download it again", path.display(), within(member), cause = shown_cause(cause))]
    Zip {
        /// Archive.
        path: PathBuf,
        /// Name of the member; none where the archive as a whole is meant.
        member: Option<String>,
        /// Error of the decoder.
        cause: Box<zip::result::ZipError>,
    },
    /// A member of an archive whose name is too long, or holds control characters that a message must not repeat.
    #[error("{}: the name of member `{}` is too long or holds control characters; rename it", path.display(), shown(member))]
    MemberName {
        /// Archive.
        path: PathBuf,
        /// Name of the member.
        member: String,
    },
    /// The same trial in two files.
    #[error(
        "{}: the trial is also in {}; the sets come as HDF5 and as JSON: convert one of the two",
        second.display(), first.display()
    )]
    Twice {
        /// File read first.
        first: PathBuf,
        /// File with the same trial.
        second: PathBuf,
    },
    /// A folder or archive without push files.
    #[error("{}: no push file in it; expected {expected}; name the folder or archive that holds them", path.display())]
    Nothing {
        /// Folder or archive.
        path: PathBuf,
        /// Which files.
        expected: &'static str,
    },
    /// A file listed in an index is not there, or the other way round.
    #[error("{}: lists `{file}`, which is not there; restore it or remove its row", path.display(), file = shown(file))]
    Unlisted {
        /// Index.
        path: PathBuf,
        /// File as listed.
        file: String,
    },
    /// A log that breaks off or holds something else.
    #[error("{}: line {line}: {expected} expected; the log is damaged or cut off: copy or download it again", path.display())]
    Log {
        /// File.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The value that should stand there.
        expected: &'static str,
    },
    /// More than [`Limit`](crate::Limit)s allow.
    #[error("{}: {part} {cause}", path.display())]
    Limit {
        /// File or archive.
        path: PathBuf,
        /// The part that is too large.
        part: FilePart,
        /// Which limit.
        cause: LimitExceeded,
    },
    /// A sampling rate that is no positive number.
    #[error("a common clock of {rate_hz} Hz makes no sense; give a positive rate such as 100")]
    Rate {
        /// Rate asked for, Hz.
        rate_hz: f64,
    },
    /// A sampling rate that makes more samples than [`Limit`](crate::Limit)s allow.
    #[error("on a common clock of {rate_hz} Hz the set {cause}")]
    RateTooHigh {
        /// Rate asked for, Hz.
        rate_hz: f64,
        /// Which limit.
        cause: LimitExceeded,
    },
}

/// `member `name`: `, or nothing.
fn within(member: &Option<String>) -> String {
    member.as_ref().map_or(String::new(), |name| format!("member `{}`: ", shown(name)))
}
