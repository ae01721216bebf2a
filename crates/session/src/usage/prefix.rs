//! Invalid lengths of the observed prefix.

use crate::prefix_length::PrefixLength;
use std::fmt;

/// Why the length of the observed prefix is invalid.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PrefixFault {
    /// No trajectory has a row within the prefix.
    NoRow { seen: PrefixLength },
    /// The prefix covers the longest trajectory completely.
    AllOfLongest { seen: PrefixLength, samples: usize },
    /// The prefix covers one trajectory completely.
    AllOf { seen: PrefixLength, trajectory: String, samples: usize },
    /// A prefix is not longer than the one given before it.
    NotLonger { before: PrefixLength, seen: PrefixLength },
}

impl fmt::Display for PrefixFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PrefixFault::NoRow { seen } => {
                write!(f, "--seen {seen}: the observed prefix is empty; give at least one row")
            }
            PrefixFault::AllOfLongest { seen, samples } => write!(
                f,
                "--seen {seen}: the longest trajectory has only {samples} samples, so nothing is left to predict; give a shorter prefix"
            ),
            PrefixFault::AllOf { seen, trajectory, samples } => write!(
                f,
                "--seen {seen}: trajectory `{trajectory}` has only {samples} samples, so nothing is left to predict; give a shorter \
                 prefix, or remove the trajectory"
            ),
            PrefixFault::NotLonger { before, seen } => {
                write!(
                    f,
                    "--seen {before},{seen}: the second prefix is not longer; give prefixes in increasing order"
                )
            }
        }
    }
}
