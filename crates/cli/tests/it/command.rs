//! Runs the `augsim` binary for tests, optionally with an expected exit code and messages.

use std::path::Path;
use std::process::{Command, Output};

/// Runs `augsim` with the arguments `args` in the folder `dir`.
pub fn augsim(args: &[&str], dir: &Path) -> Output {
    run(Command::new(env!("CARGO_BIN_EXE_augsim")).args(args).current_dir(dir))
}

/// Runs a command without the environment variables of schedulers, which tests inherit under a
/// scheduler.
pub fn run(command: &mut Command) -> Output {
    for variable in ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"] {
        if !command.get_envs().any(|(name, _)| name == variable) {
            command.env_remove(variable);
        }
    }
    command.output().expect("the binary runs")
}

/// Returns the standard output of a successful run.
pub fn succeed(args: &[&str], dir: &Path) -> String {
    let out = augsim(args, dir);
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).expect("output is text")
}

/// Returns the JSON output of a successful run with `--json`.
pub fn succeed_json(args: &[&str], dir: &Path) -> serde_json::Value {
    serde_json::from_str(&succeed(&[args, &["--json"]].concat(), dir)).expect("JSON")
}

/// Runs `augsim`, which must exit with `code` and print each of `texts`; returns its standard error.
pub fn fail(code: i32, args: &[&str], dir: &Path, texts: &[&str]) -> String {
    let out = augsim(args, dir);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "{args:?}: {error}");
    for text in texts {
        assert!(error.contains(text), "{args:?}: `{text}` is not in: {error}");
    }
    error
}
