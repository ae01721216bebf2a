//! Error for a data set that is refused because of its findings.

use super::finding::Finding;
use crate::source::Source;
use std::fmt;
use thiserror::Error;

/// Error: a data set is refused because of suspicious values.
#[derive(Debug, Clone, PartialEq, Error)]
pub struct SuspiciousData {
    /// File from which the data set was read, or code that built it.
    pub origin: Source,
    /// All findings that refuse the data set; the message shows the first in full.
    pub findings: Vec<Finding>,
}

impl fmt::Display for SuspiciousData {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(first) = self.findings.first() else {
            return write!(f, "{}: suspicious data", self.origin);
        };
        write!(f, "{}: suspicious data ({}): {first}", self.origin, first.check())?;
        let mut names: Vec<&str> = self.findings.iter().map(|f| f.check().name()).collect();
        names.dedup();
        if names.len() > 1 {
            write!(f, "; also found: {}", names[1..].join(", "))?;
        }
        let flags: Vec<String> = names.iter().map(|n| format!("--accept {n}")).collect();
        write!(f, " (to use the data as they are: {})", flags.join(" "))
    }
}
