//! The origin of a data set.

use std::fmt;
use std::path::PathBuf;

/// Origin of a data set (a file, or code), as messages name it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Source {
    /// The data set was built by code (a simulator, a split of another set without a file).
    #[default]
    Memory,
    /// The data set was read from this file.
    File(PathBuf),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Source::Memory => f.write_str("data set in memory"),
            Source::File(path) => write!(f, "{}", path.display()),
        }
    }
}
