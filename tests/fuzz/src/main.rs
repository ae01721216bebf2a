//! Command line of the fuzzer: `fuzz run`, `fuzz corpus`, and the child processes of both.

use anyhow::Context;
use augsim_fuzz::campaign::Campaign;
use augsim_fuzz::child::{self, Share};
use augsim_fuzz::limits::MAX_TIME;
use augsim_fuzz::parent::{self, Plan};
use augsim_fuzz::verdict::Finding;
use augsim_fuzz::{corpus, readers};
use clap::{Parser, Subcommand};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Searches for files that make augsim panic, hang or exhaust the memory.
#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Reads mutated files.
    Run {
        /// Number of inputs.
        #[arg(long, default_value_t = 200_000)]
        inputs: u64,
        /// Seed of the mutations.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Processes at a time; default: one per core.
        #[arg(long)]
        jobs: Option<u64>,
        /// Test this reader only.
        #[arg(long)]
        reader: Option<String>,
        /// Folder for inputs that break something.
        #[arg(long, default_value = "target/fuzz")]
        keep: PathBuf,
    },
    /// Reads all inputs that once broke a reader.
    Corpus,
    /// Reads the inputs of one process.
    #[command(hide = true)]
    Child {
        #[arg(long)]
        seed: u64,
        #[arg(long)]
        first: u64,
        #[arg(long)]
        step: u64,
        #[arg(long)]
        end: u64,
        #[arg(long)]
        reader: Option<String>,
        #[arg(long)]
        scratch: PathBuf,
        #[arg(long)]
        keep: PathBuf,
        #[arg(long)]
        limit_s: f64,
    },
    /// Reads the files in a folder.
    #[command(hide = true)]
    ChildCase {
        reader: String,
        folder: PathBuf,
        #[arg(long)]
        limit_s: f64,
    },
}

fn main() -> anyhow::Result<ExitCode> {
    let mut out = std::io::stdout();
    let findings = match Args::parse().command {
        Command::Child { seed, first, step, end, reader, scratch, keep, limit_s } => {
            let campaign = Campaign::new(seed, reader.as_deref())?;
            child::campaign(
                &campaign,
                &Share { first, step, end },
                &scratch,
                &keep,
                Duration::from_secs_f64(limit_s),
            )?;
            Vec::new()
        }
        Command::ChildCase { reader, folder, limit_s } => {
            let reader =
                readers::by_name(&reader).with_context(|| format!("there is no reader `{reader}`"))?;
            child::case(&reader, &folder, Duration::from_secs_f64(limit_s))?;
            Vec::new()
        }
        Command::Corpus => {
            let scratch = parent::scratch()?;
            let (program, cases) = (std::env::current_exe()?, corpus::cases()?);
            let mut findings = Vec::new();
            for case in &cases {
                case.files.write(scratch.path())?;
                if let Some(mut finding) = parent::case(&program, &case.reader, scratch.path(), MAX_TIME)? {
                    finding.detail = format!("{}: {}", case.name, finding.detail);
                    findings.push(finding);
                }
            }
            writeln!(out, "{} cases of the corpus", cases.len())?;
            findings
        }
        Command::Run { inputs, seed, jobs, reader, keep } => {
            let started = Instant::now();
            let cores = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
            let program = std::env::current_exe()?;
            let plan = Plan { program, inputs, seed, jobs: jobs.unwrap_or(cores).max(1), reader, keep };
            let report = parent::run(&plan)?;
            writeln!(out, "{:22} {:>9} {:>9} {:>12}", "reader", "accepted", "refused", "slowest, ms")?;
            for (name, c) in &report.counts {
                writeln!(out, "{name:22} {:>9} {:>9} {:>12}", c.accepted, c.refused, c.slowest_ms)?;
            }
            let (seconds, keep) = (started.elapsed().as_secs_f64(), plan.keep.display());
            writeln!(
                out,
                "{inputs} inputs, seed {seed}, {seconds:.0} s, {} kinds of findings",
                report.findings.len()
            )?;
            if !report.findings.is_empty() {
                writeln!(out, "inputs are kept in {keep}")?;
            }
            report.findings
        }
    };
    for Finding { class, reader, index, detail } in &findings {
        writeln!(out, "{} {reader} {index}: {detail}", class.name())?;
    }
    Ok(if findings.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
