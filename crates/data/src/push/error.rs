//! Errors in the files of the push sets: each message states file, key and remedy.

use super::fault::{FilePart, NameFault, StreamLayout};
use crate::escape_control_characters::{escaped_cause, escaped_list, escaped_short};
use crate::limits::LimitExceeded;
use std::path::PathBuf;
use thiserror::Error;

const NAME_LAYOUT: &str = "names are `motion_surface=abs_shape=rect1_a=0_v=20_i=0.000_s=0.700_t=0.000`, with \
                           `_rep=0004` for repeats, or `block=steel_run=01`; rename the file or remove it";

/// Error of reading a file of measured pushes or a set of such files.
#[derive(Debug, Error)]
pub enum PushError {
    /// A field of a push file's name has an unknown value.
    #[error(
        "{}: file name: unknown {field} `{value}`; known values are {}; correct the name or remove the file",
        path.display(), known.join(", "), value = escaped_short(value))]
    UnknownName {
        /// Path of the push file.
        path: PathBuf,
        /// Name of the field: `surface`, `shape` or `block`.
        field: &'static str,
        /// Unknown value in the file name.
        value: String,
        /// Known values of the field.
        known: Vec<&'static str>,
    },
    /// The name of a push file does not have the required pattern, or a field is missing or not a number.
    #[error("{}: file name: {fault}; {NAME_LAYOUT}", path.display())]
    Name {
        /// Path of the push file.
        path: PathBuf,
        /// Fault of the file name, with the field that has it.
        fault: NameFault,
    },
    /// The file is neither HDF5, JSON nor a zip archive.
    #[error(
        "{}: the content is neither HDF5, JSON nor a zip archive of them; copy or download the file again",
        path.display()
    )]
    UnknownContent {
        /// Path of the push file.
        path: PathBuf,
    },
    /// The HDF5 file, or one data set in it, cannot be decoded.
    #[error("{}: `{key}`: the HDF5 file is damaged or cut off ({cause}); copy or download it again", path.display(), key = escaped_short(key), cause = escaped_cause(cause))]
    Hdf5 {
        /// Path of the push file.
        path: PathBuf,
        /// Name of the HDF5 data set, or `/` for the file as a whole.
        key: String,
        /// Error of the HDF5 decoder.
        cause: Box<hdf5_reader::error::Error>,
    },
    /// The text is not JSON, or is cut off.
    #[error("{}: not valid JSON ({cause}); the file is damaged or cut off: copy or download it again", path.display(), cause = escaped_cause(cause))]
    Json {
        /// Path of the push file.
        path: PathBuf,
        /// Error of the parser, with line and column.
        cause: serde_json::Error,
    },
    /// A sensor stream (rod, object or force) is missing.
    #[error(
        "{}: stream `{key}` is missing; the file has: {}; a trial needs tip_pose, object_pose and ft_wrench: \
         copy or download the file again, or remove it", path.display(), escaped_list(found)
    )]
    MissingStream {
        /// Path of the push file.
        path: PathBuf,
        /// Key of the sensor stream in the file, such as `tip_pose`.
        key: &'static str,
        /// Names that are in the file.
        found: Vec<String>,
    },
    /// A sensor stream is not a table of four columns of 64-bit floating-point numbers.
    #[error("{}: stream `{key}` {found}; store it as rows of four numbers: time and three values", path.display())]
    Layout {
        /// Path of the push file.
        path: PathBuf,
        /// Key of the sensor stream in the file, such as `tip_pose`.
        key: &'static str,
        /// Layout that the stream has in the file.
        found: StreamLayout,
    },
    /// A value in a sensor stream is not a finite number.
    #[error("{}: stream `{key}`, row {row}: a value is not a finite number; remove the row", path.display(), key = escaped_short(key))]
    NotFinite {
        /// Path of the push file.
        path: PathBuf,
        /// Key of the sensor stream in the file, such as `tip_pose`.
        key: String,
        /// Index of the faulty row in the stream, from 0.
        row: usize,
    },
    /// The time decreases within a sensor stream.
    #[error(
        "{}: stream `{key}`, row {row}: the time decreases ({time_s} s follows {previous_s} s); sort the rows by time, \
         or remove the trial if its clock was reset", path.display()
    )]
    TimeDecreases {
        /// Path of the push file.
        path: PathBuf,
        /// Key of the sensor stream in the file, such as `tip_pose`.
        key: &'static str,
        /// Index of the faulty row in the stream, from 0.
        row: usize,
        /// Time in the row before, s.
        previous_s: f64,
        /// Time in the faulty row, s.
        time_s: f64,
    },
    /// A sensor stream has fewer than two samples at different times.
    #[error("{}: stream `{key}` has fewer than two samples at different times; remove the trial", path.display())]
    TooShort {
        /// Path of the push file.
        path: PathBuf,
        /// Key of the sensor stream in the file, such as `tip_pose`.
        key: &'static str,
    },
    /// The sensor streams of a trial do not overlap in time.
    #[error(
        "{}: tip_pose, object_pose and ft_wrench do not overlap in time; check that their clocks are the same, \
         or remove the trial", path.display()
    )]
    NoCommonTime {
        /// Path of the push file.
        path: PathBuf,
    },
    /// A zip archive, or a member of it, cannot be unpacked.
    #[error("{}: {}the zip archive is damaged or cut off ({cause}); copy or download it again", path.display(), member_prefix(member), cause = escaped_cause(cause))]
    Zip {
        /// Path of the zip archive.
        path: PathBuf,
        /// Name of the damaged member; `None` for the archive as a whole.
        member: Option<String>,
        /// Error of the zip decoder.
        cause: Box<zip::result::ZipError>,
    },
    /// The name of a member is too long or has control characters, which a message must not show.
    #[error("{}: the name of member `{}` is too long or contains control characters; rename it", path.display(), escaped_short(member))]
    MemberName {
        /// Path of the zip archive.
        path: PathBuf,
        /// Name of the archive member.
        member: String,
    },
    /// The same push trial is in two files.
    #[error(
        "{}: the same trial is also in {}; the sets are published both as HDF5 and as JSON: convert only one of them",
        second.display(), first.display()
    )]
    DuplicateTrial {
        /// Path of the file with the trial that was read first.
        first: PathBuf,
        /// Path of another file with the same trial.
        second: PathBuf,
    },
    /// A folder or an archive has no push files.
    #[error("{}: there are no push files; expected {expected}; give the folder or the archive that contains them", path.display())]
    NoPushFiles {
        /// Path of the folder or archive.
        path: PathBuf,
        /// Description of the expected files.
        expected: &'static str,
    },
    /// A file that an index lists is missing.
    #[error("{}: the listed file `{file}` is missing; restore it or remove its row", path.display(), file = escaped_short(file))]
    ListedFileMissing {
        /// Path of the index file.
        path: PathBuf,
        /// Name of the missing file, as it is in the index.
        file: String,
    },
    /// A text log of a push is cut off or has another content than expected.
    #[error("{}: line {line}: expected {expected}; the log is damaged or cut off: copy or download it again", path.display())]
    Log {
        /// Path of the push file.
        path: PathBuf,
        /// Number of the faulty line, from 1.
        line: usize,
        /// Description of the content that is expected on the line.
        expected: &'static str,
    },
    /// A part of the file exceeds a [`Limit`](crate::Limit).
    #[error("{}: {part} {cause}", path.display())]
    Limit {
        /// Path of the file or archive.
        path: PathBuf,
        /// Part of the file that is too large.
        part: FilePart,
        /// Limit that was exceeded, with its value.
        cause: LimitExceeded,
    },
    /// The sample rate for resampling is not a positive number.
    #[error("the sample rate {rate_hz} Hz is not a positive number; give a positive rate such as 100")]
    Rate {
        /// Requested sample rate, Hz.
        rate_hz: f64,
    },
    /// The sample rate for resampling gives more samples than a [`Limit`](crate::Limit) allows.
    #[error("at a sample rate of {rate_hz} Hz the data set {cause}")]
    RateTooHigh {
        /// Requested sample rate, Hz.
        rate_hz: f64,
        /// Limit that was exceeded, with its value.
        cause: LimitExceeded,
    },
}

/// Message prefix with the name of an archive member; empty for the archive as a whole.
fn member_prefix(member: &Option<String>) -> String {
    member.as_ref().map_or(String::new(), |name| format!("member `{}`: ", escaped_short(name)))
}
