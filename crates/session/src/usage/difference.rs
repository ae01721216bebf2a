//! A setting whose value on disk differs from that of the request.

use std::fmt;

/// A setting with two different values: on disk and in the request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Name of the differing setting.
    pub key: String,
    /// Value of the setting on disk.
    pub there: String,
    /// Value of the setting in the request, or in the checkpoint.
    pub here: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |value: &str| if value.is_empty() { "not given".to_owned() } else { value.to_owned() };
        write!(f, "{} is {} there and {} here", self.key, shown(&self.there), shown(&self.here))
    }
}
