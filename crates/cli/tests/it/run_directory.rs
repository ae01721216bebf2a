//! Contract: only one process writes to a run directory; a run with edited settings is neither resumed
//! nor scored; the next run removes the temporary files of killed runs and nothing else; file modes
//! follow the umask.

use crate::command::{augsim, succeed};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn refused(args: &[&str], dir: &Path, texts: &[&str]) {
    let out = augsim(args, dir);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(matches!(out.status.code(), Some(2 | 3)), "{args:?}: {error}");
    for text in texts {
        assert!(error.contains(text), "{args:?}: `{text}` is not in: {error}");
    }
}

/// Makes a folder with ball drops and a finished training run.
fn trained() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    succeed(&["simulate", "--trajectories", "12", "--samples", "40", "--out", "d.csv"], dir.path());
    succeed(
        &[
            "train",
            "--pybullet-ball",
            "--data",
            "d.csv",
            "--iterations",
            "4",
            "--recipe",
            "hybrid",
            "--out",
            "run",
        ],
        dir.path(),
    );
    dir
}

/// Starts a long training run and waits until it has written its first losses.
fn training(dir: &Path, out: &str) -> Child {
    let args = [
        "train",
        "--pybullet-ball",
        "--data",
        "d.csv",
        "--iterations",
        "1000000",
        "--recipe",
        "hybrid",
        "--out",
        out,
    ];
    let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
    command.args(args).args(["--checkpoint-every", "5"]).current_dir(dir);
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the binary runs");
    let deadline = Instant::now() + Duration::from_secs(60);
    while !dir.join(out).join("checkpoint.bin").exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

/// Runs of format 2, with names of built-in objects and scales by scenario, are rejected with a reason.
///
/// Runs of format 3 contain the text of a model file instead.
#[test]
fn rejects_runs_of_an_earlier_format_with_a_reason() {
    let dir = trained();
    let d = dir.path();
    let path = d.join("run/checkpoint.bin");
    let mut bytes = std::fs::read(&path).expect("a checkpoint");
    assert_eq!(bytes[8..12], 3_u32.to_le_bytes(), "the version of the format");
    bytes[8] = 2;
    std::fs::write(&path, bytes).expect("it can be written");
    let texts = ["checkpoint.bin", "format version 2", "reads version 3", "train again"];
    refused(&["evaluate", "run", "--data", "d.csv"], d, &texts);
    refused(&["predict", "run", "--data", "d.csv", "--out", "f.csv"], d, &texts);
    refused(&["train", "--resume", "--out", "run"], d, &texts);

    let path = d.join("run/config.resolved.toml");
    let config = std::fs::read_to_string(&path).expect("a configuration");
    assert!(config.contains("correction = \"step\"\n"), "{config}");
    std::fs::write(&path, config.replace("correction = \"step\"\n", "")).expect("it can be written");
    let texts = ["config.resolved.toml", "earlier version", "train a run", "correction"];
    refused(&["train", "--resume", "--out", "run"], d, &texts);
}

#[test]
fn rejects_a_second_training_in_the_same_directory() {
    let dir = trained();
    let d = dir.path();
    let mut first = training(d, "busy");
    for more in [&[][..], &["--resume"], &["--force"]] {
        let args =
            [&["train", "--pybullet-ball", "--data", "d.csv", "--iterations", "2", "--out", "busy"], more]
                .concat();
        refused(&args, d, &["busy", "another augsim process is writing there"]);
    }
    first.kill().expect("it can be killed");
    first.wait().expect("it ends");
    // The lock ends with the process.
    succeed(
        &["train", "--pybullet-ball", "--data", "d.csv", "--iterations", "2", "--out", "busy", "--force"],
        d,
    );
}

#[test]
fn rejects_an_edited_configuration_and_names_the_key() {
    let dir = trained();
    let d = dir.path();
    let path = d.join("run/config.resolved.toml");
    let text = std::fs::read_to_string(&path).expect("a configuration");
    let files = ["checkpoint.bin", "weights.safetensors", "metrics.jsonl"];
    let state = || files.map(|name| std::fs::read(d.join("run").join(name)).expect("a file"));
    let before = state();
    for (from, to, key) in [
        ("seed = 1", "seed = 2", "settings.seed is 2, but the checkpoint was trained with 1"),
        ("hidden = 16", "hidden = 32", "settings.net.hidden is 32"),
        ("recipe = \"hybrid\"", "recipe = \"neural\"", "settings.recipe is \"neural\""),
        ("iterations = 4", "iterations = 40", "settings.iterations is 40"),
    ] {
        assert!(text.contains(from), "{from} is not in {text}");
        std::fs::write(&path, text.replacen(from, to, 1)).expect("it can be written");
        refused(&["train", "--resume", "--out", "run"], d, &["config.resolved.toml", key]);
        refused(&["evaluate", "run", "--data", "d.csv"], d, &["config.resolved.toml", key]);
        refused(&["predict", "run", "--data", "d.csv", "--out", "f.csv"], d, &["config.resolved.toml", key]);
        assert!(state() == before && !d.join("f.csv").exists());
    }
    // The checkpoint interval does not change a run.
    std::fs::write(&path, text.replacen("checkpoint_every = 500", "checkpoint_every = 7", 1))
        .expect("a file");
    succeed(&["train", "--resume", "--out", "run"], d);
    assert!(state() == before);
}

#[test]
fn removes_temporary_files_of_killed_runs() {
    let dir = trained();
    let d = dir.path();
    // No process has this id; the other two files have no known owner.
    let left = [".checkpoint.bin.4294967295-3.tmp", ".weights.safetensors.4294967295-0.tmp"];
    let others = [".notes.tmp", "mine.4294967295-0.tmp"];
    for name in left.iter().chain(&others) {
        std::fs::write(d.join("run").join(name), "half").expect("it can be written");
    }
    succeed(&["train", "--resume", "--out", "run"], d);
    assert!(left.iter().all(|name| !d.join("run").join(name).exists()));
    assert!(others.iter().all(|name| d.join("run").join(name).exists()));
}

#[cfg(unix)]
#[test]
fn file_modes_follow_the_umask() {
    use std::os::unix::fs::PermissionsExt;
    let dir = trained();
    let script = "umask 027; exec \"$0\" train --pybullet-ball --data d.csv --iterations 2 --out masked";
    let mut sh = Command::new("sh");
    let out = sh.args(["-c", script, env!("CARGO_BIN_EXE_augsim")]).current_dir(dir.path()).output();
    assert!(out.expect("a shell").status.success());
    for name in ["config.resolved.toml", "checkpoint.bin", "weights.safetensors", "metrics.jsonl"] {
        let mode =
            std::fs::metadata(dir.path().join("masked").join(name)).expect("a file").permissions().mode();
        assert_eq!(mode & 0o777, 0o640, "{name}");
    }
}

#[test]
fn a_killed_run_leaves_no_partial_file() {
    let dir = trained();
    let d = dir.path();
    for _ in 0..5 {
        let mut child = training(d, "killed");
        child.kill().expect("it can be killed");
        child.wait().expect("it ends");
        let bytes = std::fs::read(d.join("killed/checkpoint.bin")).expect("a checkpoint");
        assert!(bytes.starts_with(b"AUGSIMCK") && bytes.len() > 1000);
        assert!(!d.join("killed/weights.safetensors").exists());
        std::fs::remove_dir_all(d.join("killed")).expect("it can be removed");
    }
    for name in ["checkpoint.bin", "weights.safetensors"] {
        assert!(std::fs::metadata(d.join("run").join(name)).expect("a file").len() > 1000);
    }
}
