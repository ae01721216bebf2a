//! Starts the children, survives their deaths, and gathers what they say.

use crate::child::{self, Counts, HANG};
use crate::limits::{TIME, UNPACKED};
use crate::reader::Files;
use crate::verdict::{Class, Finding, kind, shortened};
use anyhow::Context;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

/// A campaign to run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The `fuzz` program, which is its own child.
    pub program: PathBuf,
    /// Number of inputs.
    pub inputs: u64,
    /// Seed of the mutations.
    pub seed: u64,
    /// Processes at a time.
    pub jobs: u64,
    /// One reader only.
    pub reader: Option<String>,
    /// Where the inputs of findings go.
    pub keep: PathBuf,
}

/// The result of a campaign.
#[derive(Debug, Default)]
pub struct Report {
    /// One finding of each kind.
    pub findings: Vec<Finding>,
    /// Counts by reader.
    pub counts: BTreeMap<String, Counts>,
}

/// Runs the campaign.
///
/// # Errors
/// Children cannot be started, or they end in a way that is none of theirs.
pub fn run(plan: &Plan) -> anyhow::Result<Report> {
    let scratch = scratch()?;
    let work = |job: u64| one_job(plan, job, &scratch.path().join(job.to_string()));
    let reports = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..plan.jobs).map(|job| scope.spawn(move || work(job))).collect();
        threads
            .into_iter()
            .map(|t| t.join().unwrap_or_else(|_| anyhow::bail!("a thread of the parent panicked")))
            .collect::<anyhow::Result<Vec<_>>>()
    })?;
    let mut all = Report::default();
    for report in reports {
        for finding in report.findings {
            let kind = |f: &Finding| (f.class, f.reader.clone(), kind(f.class, &f.detail));
            if all.findings.iter().all(|known| kind(known) != kind(&finding)) {
                all.findings.push(finding);
            }
        }
        for (name, c) in report.counts {
            let sum = all.counts.entry(name).or_default();
            sum.accepted += c.accepted;
            sum.refused += c.refused;
            sum.slowest_ms = sum.slowest_ms.max(c.slowest_ms);
        }
    }
    all.findings.sort_by_key(|f| (f.class, f.index));
    Ok(all)
}

/// Reads one case, whose files lie in `folder`, in a process of its own: `None` if nothing is wrong.
///
/// # Errors
/// The child cannot be started.
pub fn case(program: &Path, reader: &str, folder: &Path, limit: Duration) -> anyhow::Result<Option<Finding>> {
    let output = Command::new(program)
        .args(["child-case", reader])
        .arg(folder)
        .args(["--limit-s", &limit.as_secs_f64().to_string()])
        .env(UNPACKED.0, UNPACKED.1)
        .output()
        .with_context(|| program.display().to_string())?;
    let mut report = Report::default();
    parse(&output, &mut report);
    Ok(report.findings.pop().or_else(|| death(&output, reader, 0)))
}

/// A folder in memory where the system has one: inputs are written a thousand times a second.
///
/// # Errors
/// The system's.
pub fn scratch() -> anyhow::Result<tempfile::TempDir> {
    let shared_memory = Path::new("/dev/shm");
    Ok(match shared_memory.is_dir() {
        true => tempfile::tempdir_in(shared_memory).or_else(|_| tempfile::tempdir())?,
        false => tempfile::tempdir()?,
    })
}

fn one_job(plan: &Plan, job: u64, scratch: &Path) -> anyhow::Result<Report> {
    fs::create_dir_all(scratch)?;
    let mut report = Report::default();
    let mut first = job;
    while first < plan.inputs {
        let mut command = Command::new(&plan.program);
        command.arg("child").args(["--seed", &plan.seed.to_string(), "--first", &first.to_string()]);
        command.args(["--step", &plan.jobs.to_string(), "--end", &plan.inputs.to_string()]);
        command.arg("--scratch").arg(scratch).arg("--keep").arg(&plan.keep);
        command.args(["--limit-s", &TIME.as_secs_f64().to_string()]);
        if let Some(reader) = &plan.reader {
            command.args(["--reader", reader]);
        }
        let output = command
            .env(UNPACKED.0, UNPACKED.1)
            .output()
            .with_context(|| plan.program.display().to_string())?;
        parse(&output, &mut report);
        if output.status.success() {
            break;
        }
        let state = fs::read_to_string(scratch.join("index")).unwrap_or_default();
        let (index, reader) = state.split_once('\t').unwrap_or_default();
        let complaint = || String::from_utf8_lossy(&output.stderr).into_owned();
        let index: u64 = index.parse().with_context(complaint)?;
        anyhow::ensure!(index >= first, "a child ended before its first input: {}", complaint());
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

/// The finding that a child's way to end is.
fn death(output: &Output, reader: &str, index: u64) -> Option<Finding> {
    if output.status.success() {
        return None;
    }
    let hang = output.status.code() == Some(HANG);
    let last = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned();
    let detail = match hang {
        true => "no answer within the time".to_owned(),
        false => shortened(&format!("{}: {last}", output.status)),
    };
    let class = if hang { Class::Hang } else { Class::Abort };
    Some(Finding { class, reader: reader.to_owned(), index, detail })
}

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
