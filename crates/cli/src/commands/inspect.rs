//! `augsim data inspect`: contents of a data set and the results of all data checks.

use augsim_data::checks::{Check, ExpectedData, Finding, Severity, run_checks};
use augsim_data::{Dataset, MissingCells, Summary};
use augsim_physics::model::ModelFile;
use augsim_session::DataFrom;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Output of `augsim data inspect`: summary of a data set and the results of all checks.
#[derive(Debug, Serialize)]
pub struct Inspection {
    #[serde(flatten)]
    summary: Summary,
    checks: Vec<Checked>,
}

/// Result of one check of the data, with its findings as text.
#[derive(Debug, Serialize)]
pub struct Checked {
    check: Check,
    looks_for: &'static str,
    outcome: CheckOutcome,
    findings: Vec<String>,
}

/// Outcome of a check of the data.
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

impl Checked {
    /// Runs all checks of suspicious data.
    ///
    /// `has_model` states whether `expected` comes from a model file, and `further` is a finding of that model.
    pub fn run_all(
        data: &Dataset,
        expected: &ExpectedData,
        has_model: bool,
        further: Option<Finding>,
    ) -> Vec<Checked> {
        let checked = |mut result: augsim_data::checks::Outcome| {
            result.findings.extend(further.clone().filter(|f| f.check() == result.check));
            let refused = result.findings.iter().any(|f| f.severity() == Severity::Refused);
            let outcome = match (result.findings.is_empty(), refused) {
                (true, _) if !has_model && result.check.needs_model() => CheckOutcome::NoModel,
                (true, _) => CheckOutcome::Passed,
                (false, true) => CheckOutcome::Refused,
                (false, false) => CheckOutcome::Warning,
            };
            let findings = result.findings.iter().map(|f| f.to_string()).collect();
            Checked { check: result.check, looks_for: result.looks_for, outcome, findings }
        };
        run_checks(data, expected).into_iter().map(checked).collect()
    }

    /// Writes the results of all checks, one line each, with the findings below.
    pub fn write_all(checks: &[Checked], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nchecks of suspicious data")?;
        for c in checks {
            writeln!(f, "  {:<20} {:<14} {}", c.check.name(), c.outcome.words(), c.looks_for)?;
            for finding in &c.findings {
                writeln!(f, "    {finding}")?;
            }
        }
        Ok(())
    }
}

/// Reads and summarises data and runs all checks; `model` enables those that compare data with a model.
pub fn inspect(from: &DataFrom, model: Option<&Path>, output: &Output) -> anyhow::Result<Inspection> {
    let data = from.read(MissingCells::AsGap)?;
    if !data.notes().is_empty() {
        output.note(format!("{from}: read as a recording: {}", data.notes().join("; ")));
    }
    let expected = match model {
        Some(path) => ModelFile::read(path)?.expected(),
        None => ExpectedData::default(),
    };
    let checks = Checked::run_all(&data, &expected, model.is_some(), None);
    Ok(Inspection { checks, summary: Summary::from_dataset(&data) })
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.summary)?;
        Checked::write_all(&self.checks, f)
    }
}
