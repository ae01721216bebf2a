//! Options of `sweep`.

use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;

/// Options of `sweep`.
#[derive(Debug, ClapArgs)]
pub struct Sweep {
    /// Action of the sweep.
    #[command(subcommand)]
    pub action: SweepAction,
}

/// Actions of `augsim sweep`.
#[derive(Debug, Subcommand)]
pub enum SweepAction {
    /// Write the tasks of a sweep: one for each combination of the listed values.
    Plan {
        /// Sweep file (TOML) with the command, its options and the lists of values to combine (grammar
        /// in docs/sweeps.md).
        sweep: PathBuf,
        /// Output folder for the tasks and, later, their results.
        #[arg(long, default_value = "out/sweep")]
        out: PathBuf,
    },
    /// Run one task, several tasks or all of them. Completed tasks are skipped.
    Run {
        /// Output folder of `sweep plan`.
        plan: PathBuf,
        /// Index of the task, from 0 (default: the environment variable `SLURM_ARRAY_TASK_ID`, else
        /// `JOB_COMPLETION_INDEX`).
        #[arg(long, conflicts_with = "all")]
        index: Option<usize>,
        /// Number of tasks to run one after another, beginning at this index.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "all")]
        count: u32,
        /// Run all tasks, as many in parallel as `--threads` allows.
        #[arg(long)]
        all: bool,
    },
    /// Submit the remaining tasks to Slurm as an array job, followed by a job that collects the results.
    Submit {
        /// Output folder of `sweep plan`.
        plan: PathBuf,
        /// Maximum number of jobs that run at the same time.
        #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
        max_parallel: Option<u32>,
        /// Slurm partition.
        #[arg(long)]
        partition: Option<String>,
        /// Time limit of a job in the format of `sbatch` (`30` minutes, `2:00:00`, `1-12`).
        #[arg(long)]
        time: Option<String>,
        /// Number of tasks that each job runs one after another (default: 1, or more if the array would
        /// exceed the limit of the cluster).
        #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
        tasks_per_job: Option<u32>,
        /// Print the script instead of submitting it. You can edit it and run it with `sh`.
        #[arg(long)]
        dry_run: bool,
    },
    /// Show how many tasks are done, running and failed, the reasons of failures, and the expected end.
    Status {
        /// Output folder of `sweep plan`.
        plan: PathBuf,
    },
    /// Collect the results in `result.json`, `table.csv` and `report.html`.
    Collect {
        /// Output folder of `sweep plan`.
        plan: PathBuf,
        /// Output folder (default: `collected` in the plan's folder).
        #[arg(long)]
        out: Option<PathBuf>,
        /// Collect the available results even if tasks are missing or failed.
        #[arg(long)]
        partial: bool,
    },
}
