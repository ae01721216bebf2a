//! Options of `sweep`.

use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;

/// Options of `sweep`.
#[derive(Debug, ClapArgs)]
pub struct Sweep {
    /// The part of a sweep that is done.
    #[command(subcommand)]
    pub action: SweepAction,
}

/// Parts of a sweep.
#[derive(Debug, Subcommand)]
pub enum SweepAction {
    /// Write the tasks of a sweep: every combination of the lists in a file.
    Plan {
        /// The command, its options and the lists to cross (TOML; grammar in docs/sweeps.md).
        sweep: PathBuf,
        /// Folder for the tasks and, later, their results.
        #[arg(long, default_value = "out/sweep")]
        out: PathBuf,
    },
    /// Run one task, or all of them. A task that is done is not run again.
    Run {
        /// Folder of `sweep plan`.
        plan: PathBuf,
        /// Place of the task, from 0; without it `SLURM_ARRAY_TASK_ID`, else `JOB_COMPLETION_INDEX` counts.
        #[arg(long, conflicts_with = "all")]
        index: Option<usize>,
        /// Tasks to run one after another, from that place on.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "all")]
        count: u32,
        /// All tasks, as many at a time as `--threads` says.
        #[arg(long)]
        all: bool,
    },
    /// Submit what is not done to Slurm: an array job, and a job that collects when it has ended.
    Submit {
        /// Folder of `sweep plan`.
        plan: PathBuf,
        /// Tasks that may run at a time.
        #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
        max_parallel: Option<u32>,
        /// Partition of the cluster.
        #[arg(long)]
        partition: Option<String>,
        /// Time limit of a job, as `sbatch` reads it (`30` minutes, `2:00:00`, `1-12`).
        #[arg(long)]
        time: Option<String>,
        /// Tasks that a job runs one after another; without it one, or as many as the cluster's largest array asks for.
        #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
        tasks_per_job: Option<u32>,
        /// Print the script instead of running it; it may be edited and run with `sh`.
        #[arg(long)]
        dry_run: bool,
    },
    /// Say how many tasks are done, run, failed and why, and when the sweep will end.
    Status {
        /// Folder of `sweep plan`.
        plan: PathBuf,
    },
    /// Put the results together: `result.json`, `table.csv`, `report.html`.
    Collect {
        /// Folder of `sweep plan`.
        plan: PathBuf,
        /// Folder for them (default: `collected` in the plan's folder).
        #[arg(long)]
        out: Option<PathBuf>,
        /// Go on although tasks are missing or failed: with the rest.
        #[arg(long)]
        partial: bool,
    },
}
