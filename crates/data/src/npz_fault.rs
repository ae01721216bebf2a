//! Faults of an array in an NPZ file.

use crate::limits::LimitExceeded;
use crate::printable::{shown_cause, shown_list};
use std::fmt;
use std::io;

/// Why an array of an NPZ file cannot be used.
#[derive(Debug)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum ArrayFault {
    /// An array that every file needs is not there.
    Missing { available: Vec<String> },
    /// Fewer or more values than samples.
    Length { found: usize, samples: usize },
    /// Other than one dimension.
    Shape { shape: Vec<u64> },
    /// Elements that are no numbers.
    NoNumbers,
    /// Elements that name nothing.
    NoTexts,
    /// A header that would take too long to read.
    Limit(LimitExceeded),
    /// Bytes that are no array.
    Damaged(io::Error),
}

impl fmt::Display for ArrayFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ArrayFault::Missing { available } => write!(
                f,
                "is missing; the file has: {}; save one-dimensional arrays `trajectory`, `t_s` and columns that end in their \
                 unit, one value a sample",
                shown_list(available)
            ),
            ArrayFault::Length { found, samples } => {
                write!(f, "{found} values where `trajectory` has {samples}; save one value for each sample")
            }
            ArrayFault::Shape { shape } => write!(f, "has shape {shape:?}; save it with one dimension"),
            ArrayFault::NoNumbers => f.write_str("is no array of numbers; save it as float64"),
            ArrayFault::NoTexts => f.write_str("is no array of texts or whole numbers; save it as str"),
            ArrayFault::Limit(cause) => write!(f, "{cause}"),
            ArrayFault::Damaged(cause) => {
                write!(f, "is damaged or cut off ({}); copy or save the file again", shown_cause(cause))
            }
        }
    }
}
