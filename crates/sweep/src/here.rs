//! `sweep run`: runs one task, several tasks or all tasks on this machine.

use super::attempt::{AttemptOutcome, Runner};
use super::clap_options::Program;
use super::failed::TaskFailed;
use super::fault::SweepFault;
use super::plan::Plan;
use super::store::Failure;
use super::task::Task;
use augsim_terminal::Outcome;
use augsim_terminal::interrupt::CheckpointGuard;
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::num::NonZero;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Environment variables that hold the task index: Slurm array jobs, Kubernetes indexed jobs.
const INDEX_VARIABLES: [&str; 2] = ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"];
/// Maximum number of attempts at a task whose process is killed, for example because of its memory.
const MAX_ATTEMPTS: u32 = 3;
/// Time between two checks of a task that another process runs.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

#[derive(Serialize)]
struct Run {
    /// Number of requested tasks.
    tasks: usize,
    /// Number of requested tasks that have a result now.
    done: usize,
    /// Number of requested tasks that had a result before.
    kept: usize,
    /// Number of requested tasks whose result does not meet the success criterion of the command.
    criterion_not_met: usize,
    /// Failure of each failed task, by task index.
    failed: BTreeMap<usize, Failure>,
}

/// Runs `count` tasks from the task `index` on, one after another.
///
/// # Errors
/// [`TaskFailed`] if a task failed; the plan has no such task; no index is given.
pub fn run_some(
    plan: &Path,
    index: Option<usize>,
    count: u32,
    threads: Option<u16>,
    program: Program,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let first = match index {
        Some(index) => index,
        None => index_from_environment()?,
    };
    let plan = Plan::open(plan)?;
    let tasks = plan.tasks_from(first, usize::try_from(count)?)?;
    let runner = Runner::new(plan, program)?;
    Work::new(&runner, tasks, threads, 1).run(1, output)
}

/// Runs all tasks of a plan in parallel on `threads` threads (all cores if `None`).
///
/// # Errors
/// [`TaskFailed`] if a task failed.
pub fn run_all(
    plan: &Path,
    threads: Option<u16>,
    program: Program,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let plan = Plan::open(plan)?;
    let tasks: Vec<(usize, Task)> = plan.tasks()?.into_iter().enumerate().collect();
    let cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
    let threads = threads.map_or_else(cores, usize::from);
    let workers = threads.min(tasks.len()).max(1);
    // Surplus cores are distributed over the tasks.
    let threads_per_task = u16::try_from((threads / workers).max(1)).unwrap_or(u16::MAX);
    let runner = Runner::new(plan, program)?;
    Work::new(&runner, tasks, Some(threads_per_task), MAX_ATTEMPTS).run(workers, output)
}

fn index_from_environment() -> Result<usize, SweepFault> {
    for variable in INDEX_VARIABLES {
        if let Some(value) = std::env::var_os(variable) {
            let number = value.to_str().and_then(|text| text.parse().ok());
            let value = || value.to_string_lossy().into_owned();
            return number.ok_or_else(|| SweepFault::NoPlace { variable, value: value() });
        }
    }
    Err(SweepFault::NoIndex { variables: &INDEX_VARIABLES })
}

/// Requested tasks that the worker threads share, and their progress.
struct Work<'a> {
    runner: &'a Runner,
    /// Number of requested tasks.
    tasks: usize,
    /// Number of threads of each task's process; all cores if `None`.
    threads: Option<u16>,
    /// Maximum number of attempts at a task whose process is killed.
    attempts: u32,
    ledger: Mutex<Ledger>,
}

/// Progress of the requested tasks: waiting, running and ended ones.
#[derive(Default)]
struct Ledger {
    waiting: VecDeque<Waiting>,
    running: usize,
    failed: usize,
    ended: BTreeMap<usize, AttemptOutcome>,
    stopped: bool,
}

/// A task that no worker runs yet.
struct Waiting {
    index: usize,
    task: Task,
    /// Number of attempts at the task so far.
    attempts: u32,
}

impl<'a> Work<'a> {
    fn new(runner: &'a Runner, tasks: Vec<(usize, Task)>, threads: Option<u16>, attempts: u32) -> Self {
        let count = tasks.len();
        let waiting = tasks.into_iter().map(|(index, task)| Waiting { index, task, attempts: 0 }).collect();
        let ledger = Mutex::new(Ledger { waiting, ..Ledger::default() });
        Work { runner, tasks: count, threads, attempts, ledger }
    }

    fn run(self, workers: usize, output: &Output) -> anyhow::Result<Outcome> {
        let keeper = CheckpointGuard::new();
        let steps = Steps::new(output);
        std::thread::scope(|scope| {
            let workers: Vec<_> =
                (0..workers).map(|_| scope.spawn(|| self.work(&keeper, &steps, output))).collect();
            workers.into_iter().try_for_each(|worker| match worker.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        steps.finish();
        let plan = self.runner.plan().folder.clone();
        let ledger = self.ledger.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut run =
            Run { tasks: self.tasks, done: 0, kept: 0, criterion_not_met: 0, failed: BTreeMap::new() };
        for (index, ended) in ledger.ended {
            match ended {
                AttemptOutcome::Done { criterion_met, kept } => {
                    run.done += 1;
                    run.kept += usize::from(kept);
                    run.criterion_not_met += usize::from(!criterion_met);
                }
                AttemptOutcome::Failed(failure) => {
                    run.failed.insert(index, failure);
                }
                AttemptOutcome::Stopped | AttemptOutcome::RunsElsewhere => {}
            }
        }
        if ledger.stopped {
            output.notice(format!(
                "stopped: {} of {} tasks are done; run the same command to continue",
                run.done, run.tasks
            ));
            return Ok(Outcome::Interrupted);
        }
        output.result(&run, || {
            let kept = if run.kept > 0 { format!(" ({} of them before)", run.kept) } else { String::new() };
            let mut text = format!("{} of {} tasks are done{kept}: {}", run.done, run.tasks, plan.display());
            for (index, failure) in &run.failed {
                text.push_str(&format!("\n  task {index} failed (code {}): {}", failure.code, failure.error));
            }
            text
        })?;
        match run.failed.first_key_value() {
            Some((&index, first)) => {
                let (failures, code, error) = (run.failed.len(), first.code, first.error.clone());
                Err(TaskFailed { index, failures, code, error }.into())
            }
            None if run.criterion_not_met > 0 => Ok(Outcome::CriterionNotMet),
            None => Ok(Outcome::Done),
        }
    }

    /// Runs waiting tasks on this worker thread until none is left.
    fn work(&self, keeper: &CheckpointGuard, steps: &Steps, output: &Output) -> anyhow::Result<()> {
        // Number of consecutive tasks that other processes run. If it reaches the number of waiting
        // tasks, this worker waits.
        let mut elsewhere = 0;
        loop {
            let next_task = {
                let mut ledger = self.ledger();
                ledger.stopped |= keeper.must_stop();
                if ledger.stopped {
                    return Ok(());
                }
                let next_task = ledger.waiting.pop_front();
                ledger.running += usize::from(next_task.is_some());
                steps.show_step(format!(
                    "{} of {} tasks, {} running, {} failed",
                    ledger.ended.len(),
                    self.tasks,
                    ledger.running,
                    ledger.failed
                ));
                next_task
            };
            let Some(mut waiting) = next_task else { return Ok(()) };
            let ended = self.runner.attempt(&waiting.task, self.threads, keeper);
            let mut ledger = self.ledger();
            ledger.running -= 1;
            // An error that prevents one worker from writing results affects the others as well.
            ledger.stopped |= ended.is_err();
            match ended? {
                AttemptOutcome::RunsElsewhere => {
                    elsewhere += 1;
                    ledger.waiting.push_back(waiting);
                    let waiting_tasks = ledger.waiting.len();
                    drop(ledger);
                    if elsewhere >= waiting_tasks {
                        if elsewhere == waiting_tasks {
                            output.detail("another process runs the remaining tasks; waiting for it");
                        }
                        std::thread::sleep(POLL_INTERVAL);
                    }
                    continue;
                }
                AttemptOutcome::Stopped => ledger.stopped = true,
                AttemptOutcome::Failed(failure)
                    if failure.code > 128 && waiting.attempts + 1 < self.attempts =>
                {
                    waiting.attempts += 1;
                    output.note(format!("task {}: {}; retrying", waiting.index, failure.error));
                    ledger.waiting.push_back(waiting);
                }
                ended => {
                    ledger.failed += usize::from(matches!(ended, AttemptOutcome::Failed(_)));
                    ledger.ended.insert(waiting.index, ended);
                }
            }
            elsewhere = 0;
        }
    }

    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        // The counts and lists stay valid after a panic of another worker.
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
