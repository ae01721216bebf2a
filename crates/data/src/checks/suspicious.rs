//! Why a set is refused, in one sentence.

use super::finding::Finding;
use crate::source::Source;
use std::fmt;
use thiserror::Error;

/// Why a set is refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub struct SuspiciousData {
    /// The set.
    pub origin: Source,
    /// Everything that refuses it, the first named in full.
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
        write!(f, " (if they are right as they are: {})", flags.join(" "))
    }
}
