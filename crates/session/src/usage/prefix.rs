//! Prefixes that cannot be forecast from.

use crate::prefix_length::Seen;
use std::fmt;

/// Why nothing can be forecast behind the rows seen.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PrefixFault {
    /// No row of any trajectory.
    NoRow { seen: Seen },
    /// All rows of the longest trajectory.
    AllOfLongest { seen: Seen, samples: usize },
    /// All rows of one trajectory.
    AllOf { seen: Seen, trajectory: String, samples: usize },
    /// No more rows than the prefix before.
    NotLonger { before: Seen, seen: Seen },
}

impl fmt::Display for PrefixFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PrefixFault::NoRow { seen } => write!(f, "--seen {seen}: no row is seen; see one at least"),
            PrefixFault::AllOfLongest { seen, samples } => write!(
                f,
                "--seen {seen}: the longest trajectory has {samples} samples, and nothing is left to forecast; see fewer"
            ),
            PrefixFault::AllOf { seen, trajectory, samples } => write!(
                f,
                "--seen {seen}: trajectory `{trajectory}` has {samples} samples, and nothing is left to forecast; see fewer, \
                 or take it out"
            ),
            PrefixFault::NotLonger { before, seen } => {
                write!(f, "--seen {before},{seen}: give prefixes from short to long")
            }
        }
    }
}
