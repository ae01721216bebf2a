//! Contract (issue 19): `sweep run --all` and its tasks may be killed at any time; restarted, they give
//! the same bytes as an undisturbed run. On a stop request it stops its tasks, which write their
//! checkpoints. This test has four kills; benches/sweeps/kills.sh has twenty and more.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn done(args: &[&str], dir: &Path) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_augsim")).args(args).current_dir(dir).output();
    let out = out.expect("the binary runs");
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

/// Plans four trainings in the folder `disturbed`, and returns the results of an undisturbed run of them.
///
/// The trainings are long enough to be interrupted.
fn workplace() -> (tempfile::TempDir, Vec<Vec<u8>>) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    done(&["simulate", "--trajectories", "20", "--samples", "40", "--out", "drops.csv"], d);
    let sweep = "command = \"train\"\n[options]\npybullet_ball = true\ndata = \"drops.csv\"\niterations = 600\ncheckpoint_every = 20\n\
                 [cross]\nrecipe = [\"hybrid\", \"hybrid-plus\"]\nseed = [1, 2]\n";
    std::fs::write(d.join("sweep.toml"), sweep).expect("a file");
    for plan in ["whole", "disturbed"] {
        done(&["sweep", "plan", "sweep.toml", "--out", plan], d);
    }
    done(&["sweep", "run", "whole", "--all", "--threads", "2"], d);
    let whole = collected("whole", d);
    (dir, whole)
}

fn collected(plan: &str, dir: &Path) -> Vec<Vec<u8>> {
    done(&["sweep", "collect", plan], dir);
    let read = |name| std::fs::read(dir.join(plan).join("collected").join(name)).expect("a result");
    ["result.json", "table.csv", "report.html"].map(read).into()
}

fn start(dir: &Path) -> Child {
    let mut command = Command::new("env");
    command.args(["--default-signal=INT,TERM", env!("CARGO_BIN_EXE_augsim")]);
    command.args(["sweep", "run", "disturbed", "--all", "--threads", "2"]).current_dir(dir);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("env starts the binary")
}

/// Waits until `ready` returns a value, at most a minute.
fn wait_for<T>(ready: impl Fn() -> Option<T>) -> T {
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        if let Some(found) = ready() {
            return found;
        }
        assert!(Instant::now() < deadline, "the sweep did not get that far in a minute");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn kill(signal: &str, process: u32) {
    // Fails if the process has already ended.
    let _ = Command::new("kill").args([&format!("-{signal}"), &process.to_string()]).status();
}

/// Returns the number of training checkpoints below a folder.
fn checkpoints(dir: &Path) -> usize {
    let tasks = std::fs::read_dir(dir.join("disturbed/work")).into_iter().flatten().flatten();
    tasks.filter(|task| task.path().join("out/checkpoint.bin").exists()).count()
}

#[test]
fn a_repeatedly_killed_sweep_gives_the_same_bytes() {
    let (dir, whole) = workplace();
    let d = dir.path();
    for pause_ms in [5, 60, 150, 330] {
        let mut child = start(d);
        std::thread::sleep(Duration::from_millis(pause_ms));
        kill("KILL", child.id());
        child.wait().expect("it ends");
    }
    done(&["sweep", "run", "disturbed", "--all", "--threads", "2"], d);
    assert!(collected("disturbed", d) == whole, "kills change the bytes");
}

#[test]
fn a_killed_task_resumes_from_its_checkpoint() {
    let (dir, whole) = workplace();
    let d = dir.path();
    let child = start(d);
    wait_for(|| (checkpoints(d) > 0).then_some(()));
    let id = child.id();
    let task = wait_for(|| {
        let tasks = std::fs::read_dir(format!("/proc/{id}/task")).ok()?.flatten();
        tasks
            .filter_map(|t| std::fs::read_to_string(t.path().join("children")).ok())
            .find_map(|children| children.split_whitespace().next()?.parse::<u32>().ok())
    });
    kill("KILL", task);
    let out = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(
        out.status.success() && said.contains("killed by SIGKILL") && said.contains("retrying"),
        "{said}"
    );
    assert!(collected("disturbed", d) == whole, "a kill changes the bytes");
}

#[test]
fn a_stopped_sweep_leaves_checkpoints_and_resumes() {
    let (dir, whole) = workplace();
    let d = dir.path();
    let child = start(d);
    wait_for(|| (checkpoints(d) > 0).then_some(()));
    let sent = Instant::now();
    kill("TERM", child.id());
    let out = child.wait_with_output().expect("it ends");
    assert!(sent.elapsed() < Duration::from_secs(3), "it took {:?}", sent.elapsed());
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(
        out.status.code() == Some(143)
            && said.contains("of 4 tasks are done; run the same command to continue"),
        "{said}"
    );
    let status = done(&["sweep", "status", "disturbed"], d);
    assert!(status.contains("; 0 running, 0 failed, "), "{status}");
    done(&["sweep", "run", "disturbed", "--all", "--threads", "2"], d);
    assert!(collected("disturbed", d) == whole, "a stop changes the bytes");
}

#[test]
fn tasks_end_when_their_sweep_is_killed() {
    let (dir, _) = workplace();
    let d = dir.path();
    let text = std::fs::read_to_string(d.join("sweep.toml")).expect("a sweep");
    std::fs::write(d.join("sweep.toml"), text.replace("= 600", "= 10000000")).expect("a file");
    done(&["sweep", "plan", "sweep.toml", "--out", "disturbed", "--force"], d);
    let mut child = start(d);
    wait_for(|| (checkpoints(d) > 1).then_some(()));
    let running = || done(&["sweep", "status", "disturbed"], d);
    assert!(running().contains("; 2 running,"), "{}", running());
    kill("KILL", child.id());
    let killed = Instant::now();
    child.wait().expect("it ends");
    wait_for(|| running().contains("; 0 running,").then_some(()));
    assert!(killed.elapsed() < Duration::from_secs(4), "tasks outlive their sweep by {:?}", killed.elapsed());
}

#[test]
fn two_simultaneous_signals_count_once() {
    let (dir, _) = workplace();
    let d = dir.path();
    let args = [
        "train",
        "--pybullet-ball",
        "--data",
        "drops.csv",
        "--iterations",
        "100000",
        "--checkpoint-every",
        "100000",
        "--out",
        "run",
    ];
    let mut command = Command::new("env");
    command.args(["--default-signal=INT,TERM", env!("CARGO_BIN_EXE_augsim")]).args(args).current_dir(d);
    let mut child =
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("env starts the binary");
    wait_for(|| std::fs::metadata(d.join("run/metrics.jsonl")).is_ok_and(|m| m.len() > 0).then_some(()));
    // As when a scheduler stops a job: it signals the task, and the parent process does as well.
    let both = format!("kill -TERM {0}; kill -INT {0}", child.id());
    assert!(Command::new("sh").args(["-c", &both]).status().expect("sh runs").success());
    child.wait().expect("it ends");
    assert!(d.join("run/checkpoint.bin").exists(), "the second signal kept it from its checkpoint");
}

#[test]
fn two_processes_share_the_tasks_of_a_plan() {
    let (dir, whole) = workplace();
    let d = dir.path();
    let both = [start(d), start(d)];
    for child in both {
        let out = child.wait_with_output().expect("it ends");
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    assert!(collected("disturbed", d) == whole, "company changes the bytes");
}
