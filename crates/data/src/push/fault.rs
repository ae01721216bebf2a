//! Faults of the file name of a trial and of the layout of a stream, with their messages.

use crate::escape_control_characters::{escaped_cause, escaped_short};
use std::fmt;

/// Fault of a field in the file name of a trial.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the message of each variant shows its fields")]
pub enum NameFault {
    /// The file name has the field `found` where a field with the key `expected` should be.
    Key { expected: String, stem: String, found: String },
    /// The file name has an extra field after the last one.
    ExtraField { field: String },
    /// The value of a field is not a number, or not a whole number where one is needed.
    NotNumber { field: String, value: String },
    /// The number of a field is outside its range `within`.
    OutOfRange { field: String, value: String, within: [f64; 2] },
    /// The index of the side (field `i`) is not a whole number.
    NotWholeIndex { value: String },
}

impl fmt::Display for NameFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NameFault::Key { expected, stem, found } => {
                write!(f, "`{stem}` has `{found}` where `{expected}=` is expected")
            }
            NameFault::ExtraField { field } => write!(f, "`{field}` is an extra field"),
            NameFault::NotNumber { field, value } => {
                write!(f, "`{field}={value}` is not a valid number")
            }
            NameFault::OutOfRange { field, value, within: [min, max] } => {
                write!(f, "`{field}={value}` is not between {min} and {max}")
            }
            NameFault::NotWholeIndex { value } => write!(f, "`i={value}` is not a whole number"),
        }
    }
}

/// Part of a push file or of an archive to which an error refers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FilePart {
    /// Member of a zip archive, by name.
    Member(String),
    /// Sensor stream of a push trial, by key.
    Stream(&'static str),
}

impl fmt::Display for FilePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FilePart::Member(name) => write!(f, "member `{}`", escaped_short(name)),
            FilePart::Stream(key) => write!(f, "stream `{key}`"),
        }
    }
}

/// Wrong layout of a sensor stream, which must be a table of four columns of 64-bit floating-point numbers.
#[derive(Debug)]
#[expect(missing_docs, reason = "the message of each variant shows its fields")]
pub enum StreamLayout {
    /// The stream does not have four columns.
    Shape { shape: Vec<u64> },
    /// The elements of the stream are not 64-bit floating-point numbers.
    Type,
    /// The stream is not rows of numbers.
    NotRows { cause: serde_json::Error },
    /// A row of the stream does not have four numbers.
    Row { row: usize, numbers: usize },
}

impl fmt::Display for StreamLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StreamLayout::Shape { shape } => write!(f, "has the shape {shape:?}"),
            StreamLayout::Type => f.write_str("has another type than 64-bit floating point"),
            StreamLayout::NotRows { cause } => {
                write!(f, "is not rows of numbers ({})", escaped_cause(cause))
            }
            StreamLayout::Row { row, numbers } => write!(f, "has {numbers} numbers in row {row}"),
        }
    }
}
