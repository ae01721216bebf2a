//! Runs one attempt at a task: the command as a separate process; stores its result in the plan folder.
//!
//! A separate process isolates tasks: if one is killed for its memory, overflows its stack or is
//! stopped, the others continue. Its threads and global state end with it, and the parent needs the
//! memory of an idle program only. Starting a process costs a few milliseconds.

use super::clap_options::{Program, SweptCommand};
use super::fault::{SweepDataError, SweepFault};
use super::inputs::Hasher;
use super::plan::Plan;
use super::store::{Failure, Store, TaskLock};
use super::task::Task;
use anyhow::Context;
use augsim_session::run_dir::{CONFIG, METRICS};
use augsim_terminal::destination::RESULT;
use augsim_terminal::interrupt::{CheckpointGuard, PARENT};
use augsim_terminal::record::RECORD;
use serde_json::Value;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Outcome of one attempt at a task of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub enum AttemptOutcome {
    /// The task has a result.
    Done {
        /// Whether the criterion of the task's command is met (exit code 0); `true` without a criterion.
        criterion_met: bool,
        /// Whether the result existed before this attempt.
        kept: bool,
    },
    /// The attempt failed, and the failure was written to the plan folder.
    Failed(Failure),
    /// The user stopped the attempt; the next one resumes from its checkpoint.
    Stopped,
    /// Another process runs the task.
    RunsElsewhere,
}

/// Runs attempts at the tasks of a plan.
#[derive(Debug)]
pub struct Runner {
    plan: Plan,
    store: Store,
    command: SweptCommand,
    program: PathBuf,
    hasher: Hasher,
}

impl Runner {
    /// Makes the runner of a plan's tasks; `program` parses their command lines.
    ///
    /// # Errors
    /// The plan's folder cannot be written to.
    pub fn new(plan: Plan, program: Program) -> anyhow::Result<Self> {
        let store = Store::for_plan(&plan.folder);
        store.prepare()?;
        let command = SweptCommand::named(&plan.shared.command, program)?;
        let program = std::env::current_exe().context("cannot find the program itself")?;
        Ok(Runner { plan, store, command, program, hasher: Hasher::default() })
    }

    /// Returns the plan whose tasks are run.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Runs a task on `threads` threads (all cores if `None`).
    ///
    /// It does not run a task that has a result or that another process runs.
    ///
    /// # Errors
    /// The plan folder is not writable. Errors of the task itself are stored as its failure.
    pub fn attempt(
        &self,
        task: &Task,
        threads: Option<u16>,
        keeper: &CheckpointGuard,
    ) -> anyhow::Result<AttemptOutcome> {
        let kept = || {
            let result = self.store.result(&task.id);
            result.map(|r| AttemptOutcome::Done { criterion_met: r.criterion_met, kept: true })
        };
        if let Some(done) = kept() {
            return Ok(done);
        }
        let TaskLock::Acquired(lock) = self.store.lock_task(&task.id)? else {
            return Ok(AttemptOutcome::RunsElsewhere);
        };
        // The previous lock holder may have completed the task.
        if let Some(done) = kept() {
            return Ok(done);
        }
        let ended = match self.check(task) {
            Ok(()) => self.run(task, threads, &lock, keeper),
            Err(error) => Err(error),
        };
        let (code, error) = match ended {
            Ok(CommandEnd::Result { criterion_met, result }) => {
                self.store.write_result(task, criterion_met, result)?;
                return Ok(AttemptOutcome::Done { criterion_met, kept: false });
            }
            Ok(CommandEnd::Stopped) => return Ok(AttemptOutcome::Stopped),
            Ok(CommandEnd::Failed { code, error }) => (code, error),
            Err(e) => (if e.is::<SweepFault>() { 2 } else { 3 }, format!("{e:#}")),
        };
        let failure = Failure { id: task.id.clone(), code, error };
        self.store.write_failure(&failure)?;
        Ok(AttemptOutcome::Failed(failure))
    }

    /// Checks that the version of augsim and the inputs of a task are those of the plan.
    fn check(&self, task: &Task) -> anyhow::Result<()> {
        let (here, planned) = (env!("CARGO_PKG_VERSION"), &task.content.augsim);
        if here != planned {
            return Err(SweepFault::OtherVersion { planned: planned.clone(), here }.into());
        }
        for (name, input) in &task.content.inputs {
            let path = self.plan.shared.folder.join(&input.path);
            let found = self.hasher.hash(&path)?;
            if found != input.sha256 {
                let (name, planned) = (name.clone(), input.sha256.clone());
                return Err(SweepDataError::Input { path, name, planned, found }.into());
            }
        }
        Ok(())
    }

    /// Runs the command of a task as a child process and waits for its end.
    fn run(
        &self,
        task: &Task,
        threads: Option<u16>,
        lock: &File,
        keeper: &CheckpointGuard,
    ) -> anyhow::Result<CommandEnd> {
        let work = self.store.work(&task.id);
        let out = work.join("out");
        let out_text = out.to_str().with_context(|| format!("{}: is not UTF-8", out.display()))?;
        let (stdout_path, log) = (work.join("stdout.json"), work.join("stderr.log"));
        let create =
            |path: &Path| File::create(path).with_context(|| format!("{}: cannot write", path.display()));
        // If an earlier attempt left its settings, the command resumes from its checkpoint.
        let resume = has_settings(&out);
        let content = &task.content;
        let arguments =
            self.command.arguments(&content.settings, &task.paths(), content.seed, out_text, resume);
        let mut command = Command::new(&self.program);
        command
            .args(["--quiet", "--json"])
            .args(threads.map(|n| format!("--threads={n}")))
            .args(arguments)
            .current_dir(&self.plan.shared.folder)
            .env(PARENT, std::process::id().to_string())
            // The child inherits the task's lock as standard input, so the task stays locked until its
            // checkpoint is written, even if this process is killed.
            .stdin(Stdio::from(lock.try_clone().context("cannot hand the task's lock on")?))
            .stdout(create(&stdout_path)?)
            .stderr(create(&log)?);
        set_process_group(&mut command);
        let started = Instant::now();
        let mut child =
            command.spawn().with_context(|| format!("{}: cannot start", self.program.display()))?;
        let status = wait(&mut child, keeper)?;
        self.store.add_seconds(&task.id, started.elapsed());
        let end = match status.code() {
            Some(code @ (0 | 1)) => {
                CommandEnd::Result { criterion_met: code == 0, result: result(&out, &stdout_path)? }
            }
            _ if keeper.must_stop() => CommandEnd::Stopped,
            Some(code) => {
                CommandEnd::Failed { code: u8::try_from(code).unwrap_or(u8::MAX), error: first_error(&log) }
            }
            None => {
                let (code, signal) = killed_by(status);
                let error = format!("killed by {signal}; run the task again to resume it");
                CommandEnd::Failed { code, error }
            }
        };
        // The standard output is part of the result now, or was not a result.
        let _ = std::fs::remove_file(&stdout_path);
        Ok(end)
    }
}

/// How the command of a task ended.
enum CommandEnd {
    Result { criterion_met: bool, result: Value },
    Failed { code: u8, error: String },
    Stopped,
}

/// Whether the command of an earlier attempt has written its settings into its output folder.
fn has_settings(out: &Path) -> bool {
    [RECORD, CONFIG].iter().any(|name| out.join(name).exists())
}

/// Starts the child in its own process group, because this process forwards signals of the terminal.
#[cfg(unix)]
fn set_process_group(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0);
}

#[cfg(not(unix))]
fn set_process_group(_command: &mut Command) {}

/// Waits for the child process to end and forwards a stop request of the user to it.
fn wait(child: &mut Child, keeper: &CheckpointGuard) -> anyhow::Result<ExitStatus> {
    // The polling interval starts short for tasks of milliseconds, and grows to a length that costs
    // nothing.
    let (mut pause, longest) = (Duration::from_micros(500), Duration::from_millis(10));
    let mut is_stop_sent = false;
    loop {
        if let Some(status) = child.try_wait().context("cannot wait for the task")? {
            return Ok(status);
        }
        if keeper.must_stop() && !is_stop_sent {
            stop(child);
            is_stop_sent = true;
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(longest);
    }
}

/// Asks a child process to write its checkpoint and end.
#[cfg(unix)]
fn stop(child: &mut Child) {
    // Fails only if the child has already ended.
    let _ =
        rustix::process::kill_process(rustix::process::Pid::from_child(child), rustix::process::Signal::TERM);
}

#[cfg(not(unix))]
fn stop(child: &mut Child) {
    let _ = child.kill();
}

/// Returns exit code (128 plus signal number) and signal name of a child process that was killed.
#[cfg(unix)]
fn killed_by(status: ExitStatus) -> (u8, String) {
    use std::os::unix::process::ExitStatusExt;
    let signal = status.signal().unwrap_or(0);
    let name = signal_hook::low_level::signal_name(signal).map_or(format!("signal {signal}"), str::to_owned);
    (u8::try_from(128 + signal).unwrap_or(u8::MAX), name)
}

#[cfg(not(unix))]
fn killed_by(_status: ExitStatus) -> (u8, String) {
    (u8::MAX, "the system".to_owned())
}

/// Reads the result of a command.
///
/// It is in `result.json`, else in the last line of the metrics, else in the standard output.
fn result(out: &Path, stdout_path: &Path) -> anyhow::Result<Value> {
    let read = |path: &Path| {
        std::fs::read_to_string(path).with_context(|| format!("{}: cannot read it", path.display()))
    };
    let (file, metrics) = (out.join(RESULT), out.join(METRICS));
    let (path, text) = if file.exists() {
        (file.as_path(), read(&file)?)
    } else if metrics.exists() {
        let lines = read(&metrics)?;
        (metrics.as_path(), lines.lines().last().unwrap_or_default().to_owned())
    } else {
        (stdout_path, read(stdout_path)?)
    };
    serde_json::from_str(&text).with_context(|| format!("{}: not a result", path.display()))
}

/// Returns the error message in the log of a failed command.
fn first_error(log: &Path) -> String {
    let text =
        std::fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let after = |mark: &str| text.lines().find_map(|line| line.strip_prefix(mark));
    let message = after("augsim: error: ").or_else(|| after("error: "));
    let message = message.or_else(|| text.lines().find(|line| line.contains("panicked")));
    message.or_else(|| text.lines().last()).unwrap_or("stdout_path nothing").to_owned()
}
