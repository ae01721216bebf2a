//! `augsim data inspect`: contents of a data set and the results of all data checks.

use augsim_data::checks::{Check, ExpectedData, Severity, run_checks};
use augsim_data::{MissingCells, Summary, read_dataset};
use augsim_physics::model::ModelFile;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Contents of a data set and the results of the checks.
#[derive(Debug, Serialize)]
pub struct Inspection {
    #[serde(flatten)]
    summary: Summary,
    checks: Vec<Checked>,
}

/// Result of one check.
#[derive(Debug, Serialize)]
struct Checked {
    check: Check,
    looks_for: &'static str,
    outcome: CheckOutcome,
    findings: Vec<String>,
}

/// Outcome of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum CheckOutcome {
    Passed,
    /// The check needs a model file, and none was given.
    NoModel,
    Warning,
    Refused,
}

impl CheckOutcome {
    fn words(self) -> &'static str {
        match self {
            CheckOutcome::Passed => "passed",
            CheckOutcome::NoModel => "needs --model",
            CheckOutcome::Warning => "warning",
            CheckOutcome::Refused => "refused",
        }
    }
}

/// Reads `file` and runs all checks; `model` enables those that compare the data with a model.
pub fn inspect(file: &Path, model: Option<&Path>, output: &Output) -> anyhow::Result<Inspection> {
    let data = read_dataset(file, MissingCells::AsGap)?;
    if !data.notes().is_empty() {
        output.note(format!("{}: read as a recording: {}", file.display(), data.notes().join("; ")));
    }
    let expected = match model {
        Some(path) => ModelFile::read(path)?.expected(),
        None => ExpectedData::default(),
    };
    let checks = run_checks(&data, &expected).into_iter().map(|result| {
        let refused = result.findings.iter().any(|f| f.severity() == Severity::Refused);
        let outcome = match (result.findings.is_empty(), refused) {
            (true, _) if model.is_none() && result.check.needs_model() => CheckOutcome::NoModel,
            (true, _) => CheckOutcome::Passed,
            (false, true) => CheckOutcome::Refused,
            (false, false) => CheckOutcome::Warning,
        };
        let findings = result.findings.iter().map(|f| f.to_string()).collect();
        Checked { check: result.check, looks_for: result.looks_for, outcome, findings }
    });
    Ok(Inspection { checks: checks.collect(), summary: Summary::from_dataset(&data) })
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.summary)?;
        writeln!(f, "\nchecks of suspicious data")?;
        for c in &self.checks {
            writeln!(f, "  {:<20} {:<14} {}", c.check.name(), c.outcome.words(), c.looks_for)?;
            for finding in &c.findings {
                writeln!(f, "    {finding}")?;
            }
        }
        Ok(())
    }
}
