//! Decides whether a data set is refused, used with warnings, or used as it is.

use super::repeated_trajectory::without_copies;
use super::suspicious::SuspiciousData;
use super::{Check, ExpectedData, Finding, Severity, run_checks};
use crate::dataset::Dataset;
use serde::{Deserialize, Serialize};

/// Set of checks whose findings the user accepts; they are not run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AcceptedChecks(u32);

impl AcceptedChecks {
    /// Adds `check` to the accepted checks.
    #[must_use]
    pub fn with(self, check: Check) -> Self {
        AcceptedChecks(self.0 | 1 << check as u32)
    }

    /// Whether `check` is accepted.
    pub fn accepts(self, check: Check) -> bool {
        self.0 >> check as u32 & 1 == 1
    }
}

impl FromIterator<Check> for AcceptedChecks {
    fn from_iter<I: IntoIterator<Item = Check>>(checks: I) -> Self {
        checks.into_iter().fold(AcceptedChecks::default(), AcceptedChecks::with)
    }
}

/// Warning about a suspicious property that does not prevent the use of the data set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// Check that led to the warning.
    pub check: Check,
    /// Message of the warning, with file, place and remedy.
    pub text: String,
}

/// A data set that passed the checks.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedData {
    /// The data set, without repeated trajectories unless these are accepted.
    pub data: Dataset,
    /// Warnings to be shown with every result.
    pub warnings: Vec<Warning>,
}

/// Runs all checks except the accepted ones, and removes repeated trajectories.
///
/// # Errors
/// [`SuspiciousData`] with the findings because of which the data set is refused.
pub fn check_data(
    data: Dataset,
    expected: &ExpectedData,
    accepted: AcceptedChecks,
) -> Result<CheckedData, SuspiciousData> {
    let outcomes = run_checks(&data, expected).into_iter().filter(|o| !accepted.accepts(o.check));
    let (refused, warned): (Vec<Finding>, Vec<Finding>) =
        outcomes.flat_map(|o| o.findings).partition(|f| f.severity() == Severity::Refused);
    if !refused.is_empty() {
        return Err(SuspiciousData { origin: data.origin().clone(), findings: refused });
    }
    let has_copies = warned.iter().any(|f| f.check() == Check::RepeatedTrajectory);
    let text = |f: &Finding| format!("{}: {f}", data.origin());
    let warnings = warned.iter().map(|f| Warning { check: f.check(), text: text(f) }).collect();
    let data = if has_copies { without_copies(&data) } else { data };
    Ok(CheckedData { data, warnings })
}
