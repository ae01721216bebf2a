//! Questions about a file that the sniffing cannot answer.

use crate::printable::{shown, shown_list};
use std::path::PathBuf;
use thiserror::Error;

/// A question that a file leaves open, with the option or the change that answers it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Unrecognised {
    /// A folder without a file that may be a recording.
    #[error("the folder holds no recordings; they end in .{}", endings.join(", ."))]
    NoRecordings {
        /// Endings of recordings.
        endings: &'static [&'static str],
    },
    /// No file was given.
    #[error("there is no file")]
    NoFile,
    /// Bytes in no encoding of text.
    #[error("it is no text; export the recording as CSV")]
    NoText,
    /// Lines that no separator and decimal mark cut into rows of numbers.
    #[error(
        "its lines are no rows of numbers; give the character between cells by --sep and the decimal mark by --decimal \
         (augsim start)"
    )]
    NoNumbers,
    /// A file that does not go with the others.
    #[error("its columns are other than those of {} ({}); read it by itself", first.display(), shown_list(columns))]
    OtherColumns {
        /// File that was read first.
        first: PathBuf,
        /// Names of its columns.
        columns: Vec<String>,
    },
    /// An option names a column that is not there.
    #[error("{option} {name}: there is no such column; the file has {}", shown_list(columns))]
    NoSuchColumn {
        /// The option.
        option: &'static str,
        /// The name that it gives.
        name: String,
        /// Names of the columns.
        columns: Vec<String>,
    },
    /// Columns without names that their numbers do not tell apart.
    #[error(
        "it has no header, and its columns cannot be told apart; name them by --time 1 --columns 2=x_m:cm,3=z_m:cm (augsim \
         start)"
    )]
    NoHeader,
    /// Frames that are numbered, with nothing that says how many there are in a second.
    #[error("times are frame numbers; give the frames a second by --rate-hz (augsim start)")]
    NoFrameRate,
    /// No column of times.
    #[error(
        "no column of times was recognised among {}; name it by --time NAME, or give the rows a second by \
         --rate-hz (augsim start), or call it t_s",
        shown_list(columns)
    )]
    NoTimes {
        /// Names of the columns.
        columns: Vec<String>,
    },
    /// A coordinate on an image whose scale is not written down.
    #[error(
        "`{0}` is in pixels; say how many metres one is, such as --columns '{0}=height_m:0.0021' (augsim start)",
        shown(column)
    )]
    Pixels {
        /// Name of the column.
        column: String,
    },
    /// No column of positions.
    #[error(
        "no column of positions was recognised among {}; name them by --columns x=x_m:cm,y=z_m:cm (augsim start)",
        shown_list(columns)
    )]
    NoPositions {
        /// Names of the columns.
        columns: Vec<String>,
    },
    /// The coordinate that is said to count upwards is not there.
    #[error("--up {name}: no coordinate is called so; there are {}", shown_list(columns))]
    NoSuchCoordinate {
        /// The name that the option gives.
        name: String,
        /// Names of the coordinates.
        columns: Vec<String>,
    },
}
