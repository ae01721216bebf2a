//! `sweep run`: one task, a few, or all of them on this machine.

use super::attempt::{Ended, Runner};
use super::clap_options::Program;
use super::failed::TaskFailed;
use super::fault::SweepFault;
use super::plan::Plan;
use super::store::Failure;
use super::task::Task;
use augsim_terminal::Outcome;
use augsim_terminal::interrupt::Keeper;
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::num::NonZero;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Variables in which schedulers say which of many like jobs this is: Slurm's arrays, Kubernetes' indexed jobs.
const INDEX_VARIABLES: [&str; 2] = ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"];
/// Attempts at a task that is killed, for its memory for example, where nobody else would begin it again.
const ATTEMPTS: u32 = 3;
/// Time between two looks at a task that another process runs.
const PATIENCE: Duration = Duration::from_millis(100);

#[derive(Serialize)]
struct Run {
    /// Tasks that were asked for.
    tasks: usize,
    /// Tasks asked for that have a result now.
    done: usize,
    /// Tasks asked for whose result was there before.
    kept: usize,
    /// Tasks asked for whose criterion is not met.
    criterion_not_met: usize,
    /// Why others have none, by their place.
    failed: BTreeMap<usize, Failure>,
}

/// Runs `count` tasks from a place on, one after another.
///
/// # Errors
/// [`TaskFailed`] where one failed; there is no such task; no place is given.
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
        None => index_of_environment()?,
    };
    let plan = Plan::open(plan)?;
    let tasks = plan.tasks_from(first, usize::try_from(count)?)?;
    let runner = Runner::new(plan, program)?;
    Work::new(&runner, tasks, threads, 1).run(1, output)
}

/// Runs all tasks, as many at a time as `threads` says (all cores without a number).
///
/// # Errors
/// [`TaskFailed`] where one failed.
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
    // Cores that there are no tasks for make the tasks faster.
    let each = u16::try_from((threads / workers).max(1)).unwrap_or(u16::MAX);
    let runner = Runner::new(plan, program)?;
    Work::new(&runner, tasks, Some(each), ATTEMPTS).run(workers, output)
}

fn index_of_environment() -> Result<usize, SweepFault> {
    for variable in INDEX_VARIABLES {
        if let Some(value) = std::env::var_os(variable) {
            let number = value.to_str().and_then(|text| text.parse().ok());
            let value = || value.to_string_lossy().into_owned();
            return number.ok_or_else(|| SweepFault::NoPlace { variable, value: value() });
        }
    }
    Err(SweepFault::NoIndex { variables: &INDEX_VARIABLES })
}

/// Tasks that workers share, and what has become of them.
struct Work<'a> {
    runner: &'a Runner,
    /// Number of tasks that were asked for.
    tasks: usize,
    /// Threads of each task.
    threads: Option<u16>,
    /// Attempts at a task that is killed.
    attempts: u32,
    ledger: Mutex<Ledger>,
}

/// Where each task stands.
#[derive(Default)]
struct Ledger {
    waiting: VecDeque<Waiting>,
    running: usize,
    failed: usize,
    ended: BTreeMap<usize, Ended>,
    stopped: bool,
}

/// A task that no worker has taken.
struct Waiting {
    index: usize,
    task: Task,
    /// Attempts that were made.
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
        let keeper = Keeper::new();
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
                Ended::Done { criterion_met, kept } => {
                    run.done += 1;
                    run.kept += usize::from(kept);
                    run.criterion_not_met += usize::from(!criterion_met);
                }
                Ended::Failed(failure) => {
                    run.failed.insert(index, failure);
                }
                Ended::Stopped | Ended::RunsElsewhere => {}
            }
        }
        if ledger.stopped {
            output.notice(format!(
                "stopped: {} of {} tasks are done; the same command goes on",
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

    /// Takes one task after another until none is left.
    fn work(&self, keeper: &Keeper, steps: &Steps, output: &Output) -> anyhow::Result<()> {
        // Tasks in a row that other processes run: once all that wait are such, there is nothing but to wait.
        let mut elsewhere = 0;
        loop {
            let taken = {
                let mut ledger = self.ledger();
                ledger.stopped |= keeper.must_stop();
                if ledger.stopped {
                    return Ok(());
                }
                let taken = ledger.waiting.pop_front();
                ledger.running += usize::from(taken.is_some());
                steps.tell(format!(
                    "{} of {} tasks, {} running, {} failed",
                    ledger.ended.len(),
                    self.tasks,
                    ledger.running,
                    ledger.failed
                ));
                taken
            };
            let Some(mut waiting) = taken else { return Ok(()) };
            let ended = self.runner.attempt(&waiting.task, self.threads, keeper);
            let mut ledger = self.ledger();
            ledger.running -= 1;
            // What keeps one worker from writing its results keeps the others too.
            ledger.stopped |= ended.is_err();
            match ended? {
                Ended::RunsElsewhere => {
                    elsewhere += 1;
                    ledger.waiting.push_back(waiting);
                    let all = ledger.waiting.len();
                    drop(ledger);
                    if elsewhere >= all {
                        if elsewhere == all {
                            output.detail("another process runs what is left; waiting for it");
                        }
                        std::thread::sleep(PATIENCE);
                    }
                    continue;
                }
                Ended::Stopped => ledger.stopped = true,
                Ended::Failed(failure) if failure.code > 128 && waiting.attempts + 1 < self.attempts => {
                    waiting.attempts += 1;
                    output.note(format!("task {}: {}; trying again", waiting.index, failure.error));
                    ledger.waiting.push_back(waiting);
                }
                ended => {
                    ledger.failed += usize::from(matches!(ended, Ended::Failed(_)));
                    ledger.ended.insert(waiting.index, ended);
                }
            }
            elsewhere = 0;
        }
    }

    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        // What a panic left of counts and lists is as true as before.
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
