//! Whether a set may be worked with: refused, with warnings, or as it is.

use super::repeated_trajectory::without_copies;
use super::suspicious::SuspiciousData;
use super::{Check, Expected, Finding, Severity, run_checks};
use crate::dataset::Dataset;
use serde::{Deserialize, Serialize};

/// Checks whose findings the user knows and accepts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Accepted(u32);

impl Accepted {
    /// Accepts the findings of `check` too.
    #[must_use]
    pub fn with(self, check: Check) -> Self {
        Accepted(self.0 | 1 << check as u32)
    }

    /// Whether `check` is accepted.
    pub fn accepts(self, check: Check) -> bool {
        self.0 >> check as u32 & 1 == 1
    }
}

impl FromIterator<Check> for Accepted {
    fn from_iter<I: IntoIterator<Item = Check>>(checks: I) -> Self {
        checks.into_iter().fold(Accepted::default(), Accepted::with)
    }
}

/// A finding with which the set is still worked with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// The check.
    pub check: Check,
    /// File, place and remedy in one sentence.
    pub text: String,
}

/// A set that may be worked with.
#[derive(Debug, Clone, PartialEq)]
pub struct Admitted {
    /// The set; without copies, unless these are accepted.
    pub data: Dataset,
    /// Warnings that a reader of the result must know.
    pub warnings: Vec<Warning>,
}

/// Runs every check that is not accepted.
///
/// # Errors
/// The findings that refuse the set.
pub fn admit(data: Dataset, expected: &Expected, accepted: Accepted) -> Result<Admitted, SuspiciousData> {
    let outcomes = run_checks(&data, expected).into_iter().filter(|o| !accepted.accepts(o.check));
    let (refused, warned): (Vec<Finding>, Vec<Finding>) =
        outcomes.flat_map(|o| o.findings).partition(|f| f.severity() == Severity::Refused);
    if !refused.is_empty() {
        return Err(SuspiciousData { origin: data.origin().clone(), findings: refused });
    }
    let repeated = warned.iter().any(|f| f.check() == Check::RepeatedTrajectory);
    let text = |f: &Finding| format!("{}: {f}", data.origin());
    let warnings = warned.iter().map(|f| Warning { check: f.check(), text: text(f) }).collect();
    let data = if repeated { without_copies(&data) } else { data };
    Ok(Admitted { data, warnings })
}
