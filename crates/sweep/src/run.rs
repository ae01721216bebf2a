//! Dispatches `augsim sweep` to its actions.

use crate::args::{Sweep, SweepAction};
use crate::clap_options::Program;
use crate::collect::collect;
use crate::failed::TaskFailed;
use crate::fault::SweepFault;
use crate::here::{run_all, run_some};
use crate::plan::write_plan;
use crate::status::status;
use crate::submit::{SubmitOptions, submit};
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;

/// Global command line options that all actions of `sweep` use.
#[derive(Debug, Clone, Copy)]
pub struct Shared {
    /// Number of worker threads; all cores if `None`.
    pub threads: Option<u16>,
    /// Whether results of another run may be overwritten.
    pub force: bool,
}

/// Runs `augsim sweep`; `program` parses the command lines of the tasks.
///
/// # Errors
/// The sweep file or the plan is invalid, a file cannot be read or written, or the scheduler rejects the
/// jobs.
pub fn run(args: &Sweep, shared: Shared, program: Program, output: &Output) -> anyhow::Result<Outcome> {
    let Shared { threads, force } = shared;
    match &args.action {
        SweepAction::Plan { sweep, out } => write_plan(sweep, out, force, program, output),
        SweepAction::Run { plan, all: true, .. } => run_all(plan, threads, program, output),
        SweepAction::Run { plan, index, count, .. } => {
            run_some(plan, *index, *count, threads, program, output)
        }
        SweepAction::Submit { plan, max_parallel, partition, time, tasks_per_job, dry_run } => {
            let options = SubmitOptions {
                max_parallel: *max_parallel,
                partition: partition.as_deref(),
                time: time.as_deref(),
                tasks_per_job: *tasks_per_job,
                threads,
            };
            submit(plan, &options, *dry_run, output)
        }
        SweepAction::Status { plan } => status(plan, output),
        SweepAction::Collect { plan, out, partial } => collect(plan, out.as_deref(), *partial, force, output),
    }
}

/// Returns the exit code of a failed sweep: that of the failed task, or 2 for a usage error.
///
/// `None` for any other error.
pub fn exit_code(error: &anyhow::Error) -> Option<u8> {
    let failed = error.chain().find_map(|cause| cause.downcast_ref::<TaskFailed>());
    let is_usage_error = || error.chain().any(|cause| cause.is::<SweepFault>());
    failed.map(|failed| failed.code).or_else(|| is_usage_error().then_some(2))
}
