//! Faults of a trial's file name and of the layout of a stream; parts of files.

use crate::printable::{shown, shown_cause};
use std::fmt;

/// Why a part of a trial's file name says nothing.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum NameFault {
    /// Another key where one is expected.
    Key { expected: String, stem: String, found: String },
    /// A field behind the last one.
    TooMany { field: String },
    /// A value that is no number, or a number of another kind.
    NoNumber { field: String, value: String },
    /// A number that no trial can have.
    OutOfRange { field: String, value: String, within: [f64; 2] },
    /// An index that is no whole number.
    NoIndex { value: String },
}

impl fmt::Display for NameFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NameFault::Key { expected, stem, found } => {
                write!(f, "`{expected}=` expected where `{stem}` has `{found}`")
            }
            NameFault::TooMany { field } => write!(f, "`{field}` is one field too many"),
            NameFault::NoNumber { field, value } => {
                write!(f, "`{field}={value}` is not a number of its kind")
            }
            NameFault::OutOfRange { field, value, within: [least, most] } => {
                write!(f, "`{field}={value}` is not within {least} to {most}")
            }
            NameFault::NoIndex { value } => write!(f, "`i={value}` is no whole number"),
        }
    }
}

/// A part of a trial's file or of an archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FilePart {
    /// A member of an archive, by its name.
    Member(String),
    /// A stream, by its key.
    Stream(&'static str),
}

impl fmt::Display for FilePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FilePart::Member(name) => write!(f, "member `{}`", shown(name)),
            FilePart::Stream(key) => write!(f, "stream `{key}`"),
        }
    }
}

/// The layout of a stream that is no table of four columns of numbers.
#[derive(Debug)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum StreamLayout {
    /// Other than four columns.
    Shape { shape: Vec<u64> },
    /// Elements of another type.
    Type,
    /// No rows of numbers.
    NoRows { cause: serde_json::Error },
    /// A row of other than four numbers.
    Row { row: usize, numbers: usize },
}

impl fmt::Display for StreamLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StreamLayout::Shape { shape } => write!(f, "a data set of shape {shape:?}"),
            StreamLayout::Type => f.write_str("another type than 64-bit floating point"),
            StreamLayout::NoRows { cause } => {
                write!(f, "other than rows of numbers ({})", shown_cause(cause))
            }
            StreamLayout::Row { row, numbers } => write!(f, "row {row} has {numbers} numbers"),
        }
    }
}
