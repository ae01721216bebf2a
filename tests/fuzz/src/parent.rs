//! Parent process: starts child processes, restarts them after crashes, and collects their reports.

use crate::child::{self, Counts, HANG_EXIT_CODE};
use crate::limits::{MAX_TIME, UNPACKED_LIMIT};
use crate::reader::Files;
use crate::verdict::{Class, Finding, finding_key, shortened};
use anyhow::Context;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

/// Settings of a fuzzing campaign.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Path of the `fuzz` program, which is also the program of the child processes.
    pub program: PathBuf,
    /// Number of inputs to read.
    pub inputs: u64,
    /// Seed of the mutations.
    pub seed: u64,
    /// Number of child processes at a time.
    pub jobs: u64,
    /// Name of the only file reader to test; `None` for all.
    pub reader: Option<String>,
    /// Folder to which inputs with findings (defects) are copied.
    pub keep: PathBuf,
}

/// Findings (defects) and counts of a fuzzing campaign.
#[derive(Debug, Default)]
pub struct Report {
    /// One finding for each kind of defect.
    pub findings: Vec<Finding>,
    /// Numbers of accepted and rejected inputs, by file reader.
    pub counts: BTreeMap<String, Counts>,
}

/// Runs a fuzzing campaign in parallel child processes.
///
/// # Errors
/// A child cannot be started, or ends in an unexpected way.
pub fn run(plan: &Plan) -> anyhow::Result<Report> {
    let scratch = scratch()?;
    let work = |job: u64| run_job(plan, job, &scratch.path().join(job.to_string()));
    let reports = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..plan.jobs).map(|job| scope.spawn(move || work(job))).collect();
        threads
            .into_iter()
            .map(|t| t.join().unwrap_or_else(|_| anyhow::bail!("a thread of the parent panicked")))
            .collect::<anyhow::Result<Vec<_>>>()
    })?;
    let mut merged = Report::default();
    for report in reports {
        for finding in report.findings {
            let key = |f: &Finding| (f.class, f.reader.clone(), finding_key(f.class, &f.detail));
            if merged.findings.iter().all(|known| key(known) != key(&finding)) {
                merged.findings.push(finding);
            }
        }
        for (name, c) in report.counts {
            let sum = merged.counts.entry(name).or_default();
            sum.accepted += c.accepted;
            sum.refused += c.refused;
            sum.slowest_ms = sum.slowest_ms.max(c.slowest_ms);
        }
    }
    merged.findings.sort_by_key(|f| (f.class, f.index));
    Ok(merged)
}

/// Reads the files in `folder` with one reader in its own process; `None` if there is no defect.
///
/// # Errors
/// The child cannot be started.
pub fn case(program: &Path, reader: &str, folder: &Path, limit: Duration) -> anyhow::Result<Option<Finding>> {
    let output = Command::new(program)
        .args(["child-case", reader])
        .arg(folder)
        .args(["--limit-s", &limit.as_secs_f64().to_string()])
        .env(UNPACKED_LIMIT.0, UNPACKED_LIMIT.1)
        .output()
        .with_context(|| program.display().to_string())?;
    let mut report = Report::default();
    parse(&output, &mut report);
    Ok(report.findings.pop().or_else(|| death(&output, reader, 0)))
}

/// Makes a temporary folder, in memory if the system allows it, as inputs are written 1000 times per second.
///
/// # Errors
/// The folder cannot be created.
pub fn scratch() -> anyhow::Result<tempfile::TempDir> {
    let shared_memory = Path::new("/dev/shm");
    Ok(match shared_memory.is_dir() {
        true => tempfile::tempdir_in(shared_memory).or_else(|_| tempfile::tempdir())?,
        false => tempfile::tempdir()?,
    })
}

/// Runs the inputs of parallel series number `job`, and restarts the child process after each crash.
fn run_job(plan: &Plan, job: u64, scratch: &Path) -> anyhow::Result<Report> {
    fs::create_dir_all(scratch)?;
    let mut report = Report::default();
    let mut first = job;
    while first < plan.inputs {
        let mut command = Command::new(&plan.program);
        command.arg("child").args(["--seed", &plan.seed.to_string(), "--first", &first.to_string()]);
        command.args(["--step", &plan.jobs.to_string(), "--end", &plan.inputs.to_string()]);
        command.arg("--scratch").arg(scratch).arg("--keep").arg(&plan.keep);
        command.args(["--limit-s", &MAX_TIME.as_secs_f64().to_string()]);
        if let Some(reader) = &plan.reader {
            command.args(["--reader", reader]);
        }
        let output = command
            .env(UNPACKED_LIMIT.0, UNPACKED_LIMIT.1)
            .output()
            .with_context(|| plan.program.display().to_string())?;
        parse(&output, &mut report);
        if output.status.success() {
            break;
        }
        let state = fs::read_to_string(scratch.join("index")).unwrap_or_default();
        let (index, reader) = state.split_once('\t').unwrap_or_default();
        let stderr_text = || String::from_utf8_lossy(&output.stderr).into_owned();
        let index: u64 = index.parse().with_context(stderr_text)?;
        anyhow::ensure!(index >= first, "a child ended before its first input: {}", stderr_text());
        if let Some(finding) = death(&output, reader, index) {
            Files::read(&scratch.join("input"))?.write(&child::finding_folder(
                &plan.keep,
                finding.class,
                reader,
                index,
            ))?;
            report.findings.push(finding);
        }
        first = index + plan.jobs;
    }
    Ok(report)
}

/// Makes the finding for a child process that crashed or hung; `None` if it ended successfully.
fn death(output: &Output, reader: &str, index: u64) -> Option<Finding> {
    if output.status.success() {
        return None;
    }
    let is_hang = output.status.code() == Some(HANG_EXIT_CODE);
    let last = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned();
    let detail = match is_hang {
        true => "no answer within the time limit".to_owned(),
        false => shortened(&format!("{}: {last}", output.status)),
    };
    let class = if is_hang { Class::Hang } else { Class::Abort };
    Some(Finding { class, reader: reader.to_owned(), index, detail })
}

/// Reads the report lines of a child process and adds them to `report`.
fn parse(output: &Output, report: &mut Report) {
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let cells: Vec<&str> = line.split('\t').collect();
        match cells[..] {
            ["finding", class, reader, index, detail] => {
                let class = if class == Class::Panic.name() { Class::Panic } else { Class::Broken };
                let index = index.parse().unwrap_or_default();
                let finding = Finding { class, reader: reader.to_owned(), index, detail: detail.to_owned() };
                report.findings.push(finding);
            }
            ["counts", reader, accepted, refused, slowest] => {
                let [accepted, refused, slowest] =
                    [accepted, refused, slowest].map(|n| n.parse::<u64>().unwrap_or(0));
                let counts = report.counts.entry(reader.to_owned()).or_default();
                counts.accepted += accepted;
                counts.refused += refused;
                counts.slowest_ms = counts.slowest_ms.max(slowest);
            }
            _ => {}
        }
    }
}
