//! Runs a command, plainly or under strace. Strace counts its system calls, or injects a fault into one.

use anyhow::Context;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Names of the system calls that change files or print output, as a list for strace.
///
/// Half of the kills happen at these calls, because they are rare among all calls of a command that computes.
pub const CHANGING: &str = "write,writev,pwrite64,openat,rename,renameat,renameat2,unlink,unlinkat,mkdir,fsync,fdatasync,ftruncate,flock,fchmod";

/// Exit code and error output of a command.
#[derive(Debug)]
pub struct Ended {
    /// Exit code of the command; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Text that the program wrote to standard error.
    pub stderr: String,
}

/// Runs `program` in `folder`.
///
/// # Errors
/// The program cannot be started.
pub fn run(program: &Path, arguments: &[String], folder: &Path) -> anyhow::Result<Ended> {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null());
    let output = command.output().with_context(|| program.display().to_string())?;
    Ok(Ended { code: output.status.code(), stderr: String::from_utf8_lossy(&output.stderr).into_owned() })
}

/// Numbers of all system calls of the kinds `set` that `program` makes, for injection by number.
///
/// A call is numbered within its thread, because strace counts in this way when it injects a fault.
///
/// # Errors
/// strace cannot be started, or the command fails under it.
pub fn places(program: &Path, arguments: &[String], folder: &Path, set: &str) -> anyhow::Result<Vec<u64>> {
    let log = folder.join("strace.log");
    let ended = strace(program, arguments, folder, &["-o", "strace.log", "-e", &format!("trace={set}")])?;
    anyhow::ensure!(ended.code == Some(0), "the command fails under strace: {}", ended.stderr);
    let text = String::from_utf8_lossy(&fs::read(&log)?).into_owned();
    fs::remove_file(&log)?;
    let mut threads: Vec<(&str, u64)> = Vec::new();
    let mut places = Vec::new();
    for line in text.lines().filter(|line| !line.contains(" resumed>") && line.contains('(')) {
        let thread = line.split_whitespace().next().unwrap_or_default();
        let index = match threads.iter().position(|(name, _)| *name == thread) {
            Some(index) => index,
            None => {
                threads.push((thread, 0));
                threads.len() - 1
            }
        };
        threads[index].1 += 1;
        places.push(threads[index].1);
    }
    anyhow::ensure!(!places.is_empty(), "strace saw no system call");
    Ok(places)
}

/// Runs `program` under strace, which injects the fault `injection` at a system call of the kinds `set`.
///
/// # Errors
/// strace cannot be started.
pub fn injected(
    program: &Path,
    arguments: &[String],
    folder: &Path,
    set: &str,
    injection: &str,
) -> anyhow::Result<Ended> {
    let (trace, inject) = (format!("trace={set}"), format!("inject={set}:{injection}"));
    strace(program, arguments, folder, &["-o", "/dev/null", "-e", &trace, "-e", &inject])
}

/// Runs `program` under strace with the strace options `options`.
fn strace(program: &Path, arguments: &[String], folder: &Path, options: &[&str]) -> anyhow::Result<Ended> {
    let mut command = Command::new("strace");
    command.args(["-f", "--seccomp-bpf", "-qqq"]).args(options).arg(program).args(arguments);
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null());
    let output = command.output().context("strace cannot be started; install it (apt-get install strace)")?;
    Ok(Ended { code: output.status.code(), stderr: String::from_utf8_lossy(&output.stderr).into_owned() })
}
