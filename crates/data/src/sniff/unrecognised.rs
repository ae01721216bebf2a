//! Properties of a file that cannot be inferred, with the option that states them.

use crate::escape_control_characters::{escaped_cause, escaped_list, escaped_short};
use crate::foreign::ForeignKind;
use std::path::PathBuf;
use thiserror::Error;

/// Reason why a file of unknown layout cannot be read, with the remedy in the message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Unrecognised {
    /// The folder has no file with the extension of a recording.
    #[error("the folder has no recordings; add files that end in .{}", endings.join(", ."))]
    NoRecordings {
        /// Extensions of the files that are read as recordings.
        endings: &'static [&'static str],
    },
    /// No file was given.
    #[error("no file was given; name at least one recording")]
    NoFile,
    /// The file is not text.
    #[error("the file is not text; export the recording as CSV")]
    NotText,
    /// The file is in a format that is not read.
    #[error("{kind}")]
    Format {
        /// Name of the format, with a conversion to CSV.
        kind: ForeignKind,
    },
    /// The zip archive holds no recording, or several.
    #[error(
        "the archive does not hold one recording; it has {}; unpack it, and give the files or their folder",
        escaped_list(files)
    )]
    Archive {
        /// Names of the recordings in the archive, or of all its files if it has no recording.
        files: Vec<String>,
    },
    /// The file is in a known format, and its content cannot be read.
    #[error("this is {format} that cannot be read ({}); save it again, or as CSV", escaped_cause(cause))]
    Damaged {
        /// Name of the format, with its article, such as "an Excel workbook".
        format: &'static str,
        /// Description of the fault in the file.
        cause: String,
    },
    /// The file has no vector of numbers.
    #[error("this is {format} without a column of at least two numbers; it has {}", escaped_list(names))]
    NoVectors {
        /// Name of the format, with its article, such as "an Excel workbook".
        format: &'static str,
        /// Names of the variables or sheets of the file.
        names: Vec<String>,
    },
    /// The file is structured text, but not a table.
    #[error(
        "this is {format}, but not a table; write a list of records such as [{{\"t_s\": 0, \"angle_rad\": 0.4}}, …] \
         or one list per column"
    )]
    NotATable {
        /// Name of the format, with its article, such as "an Excel workbook".
        format: &'static str,
    },
    /// No separator and decimal mark split the lines into rows of numbers.
    #[error(
        "its lines are not rows of numbers; give the character between cells with --sep and the decimal mark with \
         --decimal (augsim start)"
    )]
    NotNumbers,
    /// The columns of the file differ from those of the first file.
    #[error("its columns differ from those of {} ({}); read it separately", first.display(), escaped_list(columns))]
    DifferentColumns {
        /// Path of the file that was read first.
        first: PathBuf,
        /// Names of the columns of the file that was read first.
        columns: Vec<String>,
    },
    /// An option names a column that does not exist.
    #[error("{option} {name}: there is no such column; the columns are {}", escaped_list(columns))]
    NoSuchColumn {
        /// Command-line option that names the column, such as `--time`.
        option: &'static str,
        /// Name that the option gives.
        name: String,
        /// Names of the columns of the file.
        columns: Vec<String>,
    },
    /// The unit of the time column is not known.
    #[error(
        "`{}` is not a known unit of time; known are ns, us, ms, s, min, h, d, weeks, years and frames: give --time \
         COLUMN:UNIT with one of them",
        escaped_short(text)
    )]
    UnknownTimeUnit {
        /// Text of the unit as it is in the file or the option.
        text: String,
    },
    /// A cell of the time column is not a time.
    #[error(
        "line {line}, column `{}`: `{}` is not a time; write a number, an ISO 8601 date such as \
         2024-05-31T13:05:09.5, or a clock time such as 13:05:09.5",
        escaped_short(column),
        escaped_short(cell)
    )]
    NotATime {
        /// Number of the line with the cell, from 1.
        line: u64,
        /// Name of the time column.
        column: String,
        /// Text of the cell that is not a time.
        cell: String,
    },
    /// A column is renamed to a name whose unit measures another quantity.
    #[error("--columns: `{}` cannot hold values in {unit}; end the name in that unit", escaped_short(column))]
    OtherQuantity {
        /// New name of the column.
        column: String,
        /// SI unit of the values in the file.
        unit: String,
    },
    /// The columns have no names, and their meaning cannot be inferred from their numbers.
    #[error(
        "the file has no header, and the meaning of its columns cannot be inferred; name them with --time 1 \
         --columns 2=x_m:cm,3=z_m:cm (augsim start)"
    )]
    NoHeader,
    /// The times are frame numbers, and the frame rate is unknown.
    #[error("the times are frame numbers; give the frame rate in Hz with --rate-hz (augsim start)")]
    NoFrameRate,
    /// The file has no time column.
    #[error(
        "no time column was found among {}; name it with --time NAME, or give the sample rate in Hz with \
         --rate-hz (augsim start), or rename it to t_s",
        escaped_list(columns)
    )]
    NoTimes {
        /// Names of the columns of the file.
        columns: Vec<String>,
    },
    /// A coordinate is in pixels, and the size of a pixel is unknown.
    #[error(
        "`{0}` is in pixels; give the size of a pixel in metres, such as --columns '{0}=height_m:0.0021' (augsim \
         start)",
        escaped_short(column)
    )]
    Pixels {
        /// Name of the column in pixels.
        column: String,
    },
    /// The file has no column of positions.
    #[error(
        "no column of positions was found among {}; name the columns with --columns x=x_m:cm,y=z_m:cm (augsim \
         start)",
        escaped_list(columns)
    )]
    NoPositions {
        /// Names of the columns of the file.
        columns: Vec<String>,
    },
    /// The vertical coordinate that an option names does not exist.
    #[error("--up {name}: there is no such coordinate; the coordinates are {}", escaped_list(columns))]
    NoSuchCoordinate {
        /// Name that the option `--up` gives.
        name: String,
        /// Names of the coordinates of the file.
        columns: Vec<String>,
    },
}
