//! Contract: a killed and resumed run has the same checkpoint, weights and metrics as an uninterrupted
//! run.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const ITERATIONS: &str = "120";

fn command(dir: &Path, run: &str, extra: &[&str]) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_augsim"));
    c.current_dir(dir).args([
        "train",
        "--pybullet-ball",
        "--data",
        "ball.csv",
        "--recipe",
        "hybrid",
        "--out",
        run,
    ]);
    c.args(["--iterations", ITERATIONS, "--checkpoint-every", "7"]).args(extra);
    c
}

fn simulate(dir: &Path) {
    let args = ["simulate", "--trajectories", "40", "--samples", "80", "--out", "ball.csv", "--seed", "5"];
    let status = Command::new(env!("CARGO_BIN_EXE_augsim"))
        .current_dir(dir)
        .args(args)
        .output()
        .expect("the binary runs")
        .status;
    assert!(status.success());
}

#[test]
fn a_killed_run_resumes_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    simulate(dir.path());
    assert!(command(dir.path(), "whole", &["--threads", "1"]).output().unwrap().status.success());

    let mut child = command(dir.path(), "killed", &["--threads", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let checkpoint = dir.path().join("killed/checkpoint.bin");
    let deadline = Instant::now() + Duration::from_secs(60);
    while !checkpoint.exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    let ended = child.wait().unwrap();
    assert!(!ended.success(), "the run ended before it could be killed; make it longer");

    let out = command(dir.path(), "killed", &["--resume", "--threads", "7"]).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    for file in ["checkpoint.bin", "weights.safetensors", "metrics.jsonl", "config.resolved.toml"] {
        let read = |run: &str| std::fs::read(dir.path().join(run).join(file)).unwrap();
        assert!(read("whole") == read("killed"), "{file} differs");
    }
    let metrics = std::fs::read_to_string(dir.path().join("killed/metrics.jsonl")).unwrap();
    assert_eq!(metrics.lines().count(), 12);
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_saves_a_checkpoint_and_has_code_130() {
    let dir = tempfile::tempdir().unwrap();
    simulate(dir.path());
    let mut child =
        command(dir.path(), "run", &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let metrics = dir.path().join("run/metrics.jsonl");
    let deadline = Instant::now() + Duration::from_secs(60);
    while !metrics.exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(dir.path().join("run/checkpoint.bin").exists());
    let out = command(dir.path(), "run", &["--resume"]).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}

#[test]
fn rejects_resuming_on_other_data() {
    let dir = tempfile::tempdir().unwrap();
    simulate(dir.path());
    assert!(command(dir.path(), "run", &[]).output().unwrap().status.success());
    let path = dir.path().join("ball.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, tail) = text.split_at(text.len() / 2);
    std::fs::write(&path, head.to_owned() + &tail.replacen("e-5", "e-6", 1).replacen("0.", "0.1", 1))
        .unwrap();
    let out = command(dir.path(), "run", &["--resume"]).output().unwrap();
    assert_eq!(out.status.code(), Some(3), "{}", String::from_utf8_lossy(&out.stderr));
}
