//! One attempt at a task: the command as a process of its own, its result in the plan's folder.
//!
//! A process of its own and not a call: a task may be killed for its memory, overflow its stack or be stopped without the
//! others noticing, its threads and its global state end with it, and whoever runs it needs the memory of an idle program.
//! It costs some milliseconds.

use super::clap_options::{Program, SweptCommand};
use super::fault::{Spoilt, SweepFault};
use super::inputs::Hasher;
use super::plan::Plan;
use super::store::{Failure, Store, Turn};
use super::task::Task;
use anyhow::Context;
use augsim_session::run_dir::{CONFIG, METRICS};
use augsim_terminal::destination::RESULT;
use augsim_terminal::interrupt::{Keeper, PARENT};
use augsim_terminal::record::RECORD;
use serde_json::Value;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How an attempt ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The result is there; whether the criterion is met that the task asked for.
    Done {
        /// Always so without a criterion.
        criterion_met: bool,
        /// Whether it was there before.
        kept: bool,
    },
    /// The attempt failed, which is written down.
    Failed(Failure),
    /// The user stopped it; the next attempt goes on.
    Stopped,
    /// Another process runs it.
    RunsElsewhere,
}

/// Runs tasks of a plan.
#[derive(Debug)]
pub struct Runner {
    plan: Plan,
    store: Store,
    command: SweptCommand,
    program: PathBuf,
    hasher: Hasher,
}

impl Runner {
    /// Makes the runner of a plan's tasks.
    ///
    /// # Errors
    /// The plan's folder cannot be written to.
    pub fn new(plan: Plan, program: Program) -> anyhow::Result<Self> {
        let store = Store::of(&plan.folder);
        store.prepare()?;
        let command = SweptCommand::named(&plan.shared.command, program)?;
        let program = std::env::current_exe().context("cannot find the program itself")?;
        Ok(Runner { plan, store, command, program, hasher: Hasher::default() })
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Runs a task on that many threads (all cores without a number), unless its result is there or it runs elsewhere.
    ///
    /// # Errors
    /// The plan's folder cannot be written to; everything that is wrong with the task itself is its failure.
    pub fn attempt(&self, task: &Task, threads: Option<u16>, keeper: &Keeper) -> anyhow::Result<Ended> {
        let kept = || {
            let result = self.store.result(&task.id);
            result.map(|r| Ended::Done { criterion_met: r.criterion_met, kept: true })
        };
        if let Some(done) = kept() {
            return Ok(done);
        }
        let Turn::Ours(lock) = self.store.take_turn(&task.id)? else { return Ok(Ended::RunsElsewhere) };
        // Whoever had the lock before may have finished it.
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
                return Ok(Ended::Done { criterion_met, kept: false });
            }
            Ok(CommandEnd::Stopped) => return Ok(Ended::Stopped),
            Ok(CommandEnd::Failed { code, error }) => (code, error),
            Err(e) => (if e.is::<SweepFault>() { 2 } else { 3 }, format!("{e:#}")),
        };
        let failure = Failure { id: task.id.clone(), code, error };
        self.store.write_failure(&failure)?;
        Ok(Ended::Failed(failure))
    }

    /// Checks that this program is the one that the task was planned for, and that its inputs are as they were.
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
                return Err(Spoilt::Input { path, name, planned, found }.into());
            }
        }
        Ok(())
    }

    /// Runs the command.
    fn run(
        &self,
        task: &Task,
        threads: Option<u16>,
        lock: &File,
        keeper: &Keeper,
    ) -> anyhow::Result<CommandEnd> {
        let work = self.store.work(&task.id);
        let out = work.join("out");
        let out_text = out.to_str().with_context(|| format!("{}: is not UTF-8", out.display()))?;
        let (said, log) = (work.join("stdout.json"), work.join("stderr.log"));
        let create =
            |path: &Path| File::create(path).with_context(|| format!("{}: cannot write", path.display()));
        // An attempt that was killed left its settings; the command goes on from its checkpoint.
        let resume = is_begun(&out);
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
            // The child holds the task's lock as long as it lives: it needs a moment for its checkpoint when this process is
            // killed.
            .stdin(Stdio::from(lock.try_clone().context("cannot hand the task's lock on")?))
            .stdout(create(&said)?)
            .stderr(create(&log)?);
        apart(&mut command);
        let begun = Instant::now();
        let mut child =
            command.spawn().with_context(|| format!("{}: cannot start", self.program.display()))?;
        let status = wait(&mut child, keeper)?;
        self.store.add_seconds(&task.id, begun.elapsed());
        let end = match status.code() {
            Some(code @ (0 | 1)) => {
                CommandEnd::Result { criterion_met: code == 0, result: result(&out, &said)? }
            }
            _ if keeper.must_stop() => CommandEnd::Stopped,
            Some(code) => {
                CommandEnd::Failed { code: u8::try_from(code).unwrap_or(u8::MAX), error: first_error(&log) }
            }
            None => {
                let (code, signal) = killed_by(status);
                let error = format!("was killed by {signal}; run it again to go on from what it has");
                CommandEnd::Failed { code, error }
            }
        };
        // What it printed is in the result now, or was no result.
        let _ = std::fs::remove_file(&said);
        Ok(end)
    }
}

/// How the command of a task ended.
enum CommandEnd {
    Result { criterion_met: bool, result: Value },
    Failed { code: u8, error: String },
    Stopped,
}

/// Whether a command has written its settings into its folder.
fn is_begun(out: &Path) -> bool {
    [RECORD, CONFIG].iter().any(|name| out.join(name).exists())
}

/// Keeps a signal that a terminal sends to all its processes from the child: this process passes it on.
#[cfg(unix)]
fn apart(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0);
}

#[cfg(not(unix))]
fn apart(_command: &mut Command) {}

/// Waits for the child, and stops it when the user asks to.
fn wait(child: &mut Child, keeper: &Keeper) -> anyhow::Result<ExitStatus> {
    // Short at first, so that a task of milliseconds is not kept waiting, then so long that waiting costs nothing.
    let (mut pause, longest) = (Duration::from_micros(500), Duration::from_millis(10));
    let mut told = false;
    loop {
        if let Some(status) = child.try_wait().context("cannot wait for the task")? {
            return Ok(status);
        }
        if keeper.must_stop() && !told {
            stop(child);
            told = true;
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(longest);
    }
}

/// Asks a child to end; it writes its checkpoint first.
#[cfg(unix)]
fn stop(child: &mut Child) {
    // Fails only where it has ended already.
    let _ =
        rustix::process::kill_process(rustix::process::Pid::from_child(child), rustix::process::Signal::TERM);
}

#[cfg(not(unix))]
fn stop(child: &mut Child) {
    let _ = child.kill();
}

/// Exit code and name of the signal that ended a child.
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

/// The result of a command: its `result.json`, else the last line of its metrics, else what it printed.
fn result(out: &Path, said: &Path) -> anyhow::Result<Value> {
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
        (said, read(said)?)
    };
    serde_json::from_str(&text).with_context(|| format!("{}: is no result", path.display()))
}

/// The sentence of a command that failed.
fn first_error(log: &Path) -> String {
    let text =
        std::fs::read(log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let after = |mark: &str| text.lines().find_map(|line| line.strip_prefix(mark));
    let told = after("augsim: error: ").or_else(|| after("error: "));
    let told = told.or_else(|| text.lines().find(|line| line.contains("panicked")));
    told.or_else(|| text.lines().last()).unwrap_or("said nothing").to_owned()
}
