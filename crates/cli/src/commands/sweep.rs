//! `augsim sweep`.

use crate::args::Global;
use crate::exit::Outcome;
use crate::output::Output;
use crate::sweep;
use crate::sweep::args::{Sweep, SweepAction};

/// Runs the subcommand.
pub fn run(args: &Sweep, global: &Global, output: &Output) -> anyhow::Result<Outcome> {
    match &args.action {
        SweepAction::Plan { sweep, out } => sweep::write_plan(sweep, out, global.force, output),
        SweepAction::Run { plan, all: true, .. } => sweep::run_all(plan, global.threads, output),
        SweepAction::Run { plan, index, count, .. } => {
            sweep::run_some(plan, *index, *count, global.threads, output)
        }
        SweepAction::Submit { plan, max_parallel, partition, time, tasks_per_job, dry_run } => {
            let wishes = sweep::Wishes {
                max_parallel: *max_parallel,
                partition: partition.as_deref(),
                time: time.as_deref(),
                tasks_per_job: *tasks_per_job,
                threads: global.threads,
            };
            sweep::submit(plan, &wishes, *dry_run, output)
        }
        SweepAction::Status { plan } => sweep::status(plan, output),
        SweepAction::Collect { plan, out, partial } => {
            sweep::collect(plan, out.as_deref(), *partial, global.force, output)
        }
    }
}
