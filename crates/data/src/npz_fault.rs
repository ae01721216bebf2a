//! Faults of an array in an NPZ file, with their messages.

use crate::escape_control_characters::{escaped_cause, escaped_list};
use crate::limits::LimitExceeded;
use std::fmt;
use std::io;

/// Reason why an array of an NPZ file cannot be used; `Display` gives the message with the remedy.
#[derive(Debug)]
#[expect(missing_docs, reason = "the message of each variant shows its fields")]
pub enum ArrayFault {
    /// The required array is missing in the file; `available` are the names of the others.
    Missing { available: Vec<String> },
    /// The array has fewer or more values than there are samples.
    Length { found: usize, samples: usize },
    /// The array is not one-dimensional.
    Shape { shape: Vec<u64> },
    /// The elements of the array are not numbers.
    NotNumbers,
    /// The elements of the array are neither texts nor whole numbers.
    NotTexts,
    /// The elements of the array are Python objects.
    Objects,
    /// The header of the array exceeds a limit.
    Limit(LimitExceeded),
    /// The bytes are not a complete array, because the file is damaged or cut off.
    Damaged(io::Error),
}

impl fmt::Display for ArrayFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ArrayFault::Missing { available } => write!(
                f,
                "is missing; the file has: {}; save one-dimensional arrays `trajectory`, `t_s` and one for each \
                 column whose name ends in its unit, with one value per sample",
                escaped_list(available)
            ),
            ArrayFault::Length { found, samples } => {
                write!(f, "has {found} values but `trajectory` has {samples}; save one value per sample")
            }
            ArrayFault::Shape { shape } => write!(f, "has the shape {shape:?}; save it with one dimension"),
            ArrayFault::NotNumbers => f.write_str("is not an array of numbers; save it as float64"),
            ArrayFault::NotTexts => f.write_str("is not an array of texts or whole numbers; save it as str"),
            ArrayFault::Objects => f.write_str(
                "holds Python objects, as np.savez writes a column of texts; convert it first: np.asarray(a, dtype=str)",
            ),
            ArrayFault::Limit(cause) => write!(f, "{cause}"),
            ArrayFault::Damaged(cause) => {
                write!(f, "is damaged or cut off ({}); copy or save the file again", escaped_cause(cause))
            }
        }
    }
}
