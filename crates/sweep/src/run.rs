//! `augsim sweep`: which of its parts is done.

use crate::args::{Sweep, SweepAction};
use crate::clap_options::Program;
use crate::collect::collect;
use crate::failed::TaskFailed;
use crate::fault::SweepFault;
use crate::here::{run_all, run_some};
use crate::plan::write_plan;
use crate::status::status;
use crate::submit::{Wishes, submit};
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;

/// Options that all commands share.
#[derive(Debug, Clone, Copy)]
pub struct Shared {
    /// Worker threads; all cores without a number.
    pub threads: Option<u16>,
    /// Whether results of another run are replaced.
    pub force: bool,
}

/// Runs the subcommand; `program` is the parser of the command lines of tasks.
///
/// # Errors
/// The sweep file or the plan is wrong, a file cannot be read or written, or the scheduler refuses.
pub fn run(args: &Sweep, shared: Shared, program: Program, output: &Output) -> anyhow::Result<Outcome> {
    let Shared { threads, force } = shared;
    match &args.action {
        SweepAction::Plan { sweep, out } => write_plan(sweep, out, force, program, output),
        SweepAction::Run { plan, all: true, .. } => run_all(plan, threads, program, output),
        SweepAction::Run { plan, index, count, .. } => {
            run_some(plan, *index, *count, threads, program, output)
        }
        SweepAction::Submit { plan, max_parallel, partition, time, tasks_per_job, dry_run } => {
            let wishes = Wishes {
                max_parallel: *max_parallel,
                partition: partition.as_deref(),
                time: time.as_deref(),
                tasks_per_job: *tasks_per_job,
                threads,
            };
            submit(plan, &wishes, *dry_run, output)
        }
        SweepAction::Status { plan } => status(plan, output),
        SweepAction::Collect { plan, out, partial } => collect(plan, out.as_deref(), *partial, force, output),
    }
}

/// The exit code of a failed sweep: that of the task that failed, or 2 for a mistake in the sweep file; `None` for other errors.
pub fn exit_code(error: &anyhow::Error) -> Option<u8> {
    let failed = error.chain().find_map(|cause| cause.downcast_ref::<TaskFailed>());
    let is_mistake = || error.chain().any(|cause| cause.is::<SweepFault>());
    failed.map(|failed| failed.code).or_else(|| is_mistake().then_some(2))
}
