//! A setting that has one value on disk and another in the request.

use std::fmt;

/// A setting with its two values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Name of the setting.
    pub key: String,
    /// Its value on disk.
    pub there: String,
    /// Its value in the request, or in the checkpoint.
    pub here: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is {} there and {} here", self.key, self.there, self.here)
    }
}
