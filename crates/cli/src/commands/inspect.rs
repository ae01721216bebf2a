//! `augsim data inspect`: what a set contains, and the outcome of every check.

use augsim_data::checks::{Check, Expected, Severity, run_checks};
use augsim_data::{MissingCells, Summary, read_dataset};
use augsim_physics::model::ModelFile;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Contents of a set and the checks.
#[derive(Debug, Serialize)]
pub struct Inspection {
    #[serde(flatten)]
    summary: Summary,
    checks: Vec<Checked>,
}

/// One check.
#[derive(Debug, Serialize)]
struct Checked {
    check: Check,
    looks_for: &'static str,
    outcome: CheckOutcome,
    findings: Vec<String>,
}

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum CheckOutcome {
    Passed,
    /// There is no model to compare with.
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

/// Reads `file` and, for the checks that compare with one, a model file.
pub fn inspect(file: &Path, model: Option<&Path>, output: &Output) -> anyhow::Result<Inspection> {
    let data = read_dataset(file, MissingCells::AsGap)?;
    if !data.notes().is_empty() {
        output.note(format!("{}: read as a recording: {}", file.display(), data.notes().join("; ")));
    }
    let expected = match model {
        Some(path) => ModelFile::read(path)?.expected(),
        None => Expected::default(),
    };
    let checks = run_checks(&data, &expected).into_iter().map(|o| {
        let refused = o.findings.iter().any(|f| f.severity() == Severity::Refused);
        let outcome = match (o.findings.is_empty(), refused) {
            (true, _) if model.is_none() && o.check.needs_model() => CheckOutcome::NoModel,
            (true, _) => CheckOutcome::Passed,
            (false, true) => CheckOutcome::Refused,
            (false, false) => CheckOutcome::Warning,
        };
        let findings = o.findings.iter().map(|f| f.to_string()).collect();
        Checked { check: o.check, looks_for: o.looks_for, outcome, findings }
    });
    Ok(Inspection { checks: checks.collect(), summary: Summary::of(&data) })
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
