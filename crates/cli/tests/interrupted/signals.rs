//! Contract: SIGINT, SIGTERM and SIGHUP end every command within two seconds with code 130, 143 and 129
//! and a message that names the signal; no partial or temporary file and no empty folder remains.
//! Training writes a checkpoint first, and a discovery its best result so far. Work is stopped during computation and
//! while it waits for data from a pipe.
#![cfg(unix)]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SIGNALS: [(&str, i32); 3] = [("INT", 130), ("TERM", 143), ("HUP", 129)];
/// Time in which a command must stop: the required two seconds, plus one for a machine busy with other tests.
const LIMIT: Duration = Duration::from_secs(3);

/// Starts the command with default signal actions, which the test runner may have changed.
fn start(args: &[&str], dir: &Path) -> Child {
    let mut command = Command::new("env");
    command.args(["--default-signal=HUP,INT,TERM", env!("CARGO_BIN_EXE_augsim")]).args(args).current_dir(dir);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("env starts the binary")
}

/// Sends a signal to a command, checks its exit code and how soon it ends, and returns its standard error.
fn stop(mut child: Child, signal: &str, code: i32, args: &[&str]) -> String {
    assert!(child.try_wait().expect("its state").is_none(), "{args:?} ended before it could be stopped");
    let sent = Instant::now();
    let kill = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
    assert!(kill.expect("kill runs").success());
    let out = child.wait_with_output().expect("it ends");
    assert!(sent.elapsed() < LIMIT, "{args:?}: {signal} took {:?}", sent.elapsed());
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "{args:?}, {signal}: {error}");
    error
}

/// Waits until `ready` returns true, at most a minute.
fn wait_until(ready: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !ready() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(ready(), "the command did not get that far in a minute");
}

fn run(args: &[&str], dir: &Path) {
    let out = Command::new(env!("CARGO_BIN_EXE_augsim")).args(args).current_dir(dir).output();
    let out = out.expect("the binary runs");
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
}

/// Returns all paths in a folder.
fn tree(dir: &Path) -> Vec<String> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(dir).expect("a folder").flatten() {
        all.push(entry.path().display().to_string());
        if entry.path().is_dir() {
            all.extend(tree(&entry.path()));
        }
    }
    all.sort();
    all
}

/// Opens the pipe for writing, which waits until a command opens it for reading.
fn read_from(pipe: PathBuf) -> File {
    let (tell, told) = std::sync::mpsc::channel();
    std::thread::spawn(move || tell.send(File::options().write(true).open(pipe)));
    told.recv_timeout(Duration::from_secs(60)).expect("the command opens its data").expect("a pipe")
}

#[test]
fn stops_while_waiting_for_data_without_leftovers() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    run(&["simulate", "--trajectories", "4", "--samples", "20", "--out", "d.csv"], d);
    run(&["train", "--pybullet-ball", "--data", "d.csv", "--iterations", "2", "--out", "run"], d);
    std::fs::write(d.join("model.toml"), "scenario = \"ball\"\n").expect("a model");
    assert!(Command::new("mkfifo").arg(d.join("pipe.csv")).status().expect("mkfifo runs").success());
    let before = tree(d);
    for (k, args) in [
        &["discover", "model.toml", "pipe.csv", "--out", "new/found"][..],
        &["train", "--pybullet-ball", "--data", "pipe.csv", "--out", "new/run"],
        &["predict", "run", "--data", "pipe.csv", "--out", "new/forecast.csv"],
        &["evaluate", "run", "--data", "pipe.csv"],
        &["data", "convert", "mit-push", "pipe.csv", "new/pushes.csv"],
        &["data", "inspect", "pipe.csv"],
    ]
    .into_iter()
    .enumerate()
    {
        let (signal, code) = SIGNALS[k % SIGNALS.len()];
        let child = start(args, d);
        let _writer = read_from(d.join("pipe.csv"));
        let error = stop(child, signal, code, args);
        assert!(error.contains(&format!("stopped by SIG{signal}")), "{error}");
        assert_eq!(tree(d), before, "{args:?}");
    }
}

#[test]
fn stops_during_computation_without_leftovers() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    run(&["simulate", "--trajectories", "400", "--samples", "100", "--out", "d.csv"], d);
    run(&["train", "--pybullet-ball", "--data", "d.csv", "--iterations", "2", "--out", "run"], d);
    let before = tree(d);
    for (k, args) in [
        &["predict", "run", "--data", "d.csv", "--samples", "4000", "--out", "new/forecast.csv"][..],
        &["simulate", "--scenario", "push", "--trajectories", "5000", "--out", "new/pushes.csv"],
    ]
    .into_iter()
    .enumerate()
    {
        let (signal, code) = SIGNALS[k % SIGNALS.len()];
        let child = start(args, d);
        wait_until(|| d.join("new").exists());
        std::thread::sleep(Duration::from_millis(100));
        stop(child, signal, code, args);
        assert_eq!(tree(d), before, "{args:?}");
    }
}

#[test]
fn a_discovery_leaves_its_best_result_so_far() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let mut data = "trajectory,t_s,pos_m\n".to_owned();
    for r in 0..8 {
        let (mut x, mut v) = (1.0 + 0.1 * f64::from(r), 0.0);
        for k in 0..100 {
            let error = 1e-3 * (f64::from(137 * r + k) * 12.9898).sin();
            data += &format!("{r},{:.2},{:.6}\n", 0.05 * f64::from(k), x + error);
            for _ in 0..500 {
                (x, v) = (x + 1e-4 * v, v + 1e-4 * (-4.0 * x - 0.1 * v - 0.2 * x * x * x));
            }
        }
    }
    std::fs::write(d.join("data.csv"), data).expect("written");
    let model = "scenario = \"system\"\nname = \"spring\"\n[states]\nx_m = { start = \"pos_m\" }\n\
                 v_m_s = { start = \"slope(pos_m)\" }\n[parameters]\nk_per_s2 = { nominal = 3.0, min = 0.0, max = 90.0 }\n\
                 [rates]\nx_m = \"v_m_s\"\nv_m_s = \"-k_per_s2 * x_m\"\n[outputs]\npos_m = { value = \"x_m\", sd = 0.001 }\n";
    std::fs::write(d.join("model.toml"), model).expect("written");
    let args = ["discover", "model.toml", "data.csv", "--force", "--out", "stopped"];
    // The time of the calibration depends on the machine, so the signal is tried later and later. The run takes
    // several times as long as its calibration, so these steps cannot pass over all of it.
    let mut wait_s = 0.5;
    while !d.join("stopped/result.json").exists() {
        assert!(wait_s < 60.0, "no result in a minute");
        let child = start(&args, d);
        std::thread::sleep(Duration::from_secs_f64(wait_s));
        stop(child, "TERM", 143, &args);
        wait_s *= 1.3;
    }
    let result = std::fs::read_to_string(d.join("stopped/result.json")).expect("a result");
    assert!(result.contains("The search was stopped by a signal"), "{result}");
    assert!(d.join("stopped/model.toml").exists());
}

#[test]
fn training_writes_a_checkpoint_on_every_signal_and_resumes() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    run(&["simulate", "--trajectories", "20", "--samples", "40", "--out", "d.csv"], d);
    let train = [
        "train",
        "--pybullet-ball",
        "--data",
        "d.csv",
        "--recipe",
        "hybrid",
        "--iterations",
        "1500",
        "--out",
    ];
    run(&[&train[..], &["whole"]].concat(), d);
    for (signal, code) in SIGNALS {
        let args = [&train[..], &[signal]].concat();
        let child = start(&args, d);
        wait_until(|| std::fs::metadata(d.join(signal).join("metrics.jsonl")).is_ok_and(|m| m.len() > 0));
        let error = stop(child, signal, code, &args);
        assert!(error.contains("interrupted after iteration") && error.contains("--resume"), "{error}");
        assert!(d.join(signal).join("checkpoint.bin").exists());
        run(&["train", "--resume", "--out", signal], d);
        for file in ["checkpoint.bin", "weights.safetensors", "metrics.jsonl"] {
            let read = |run: &str| std::fs::read(d.join(run).join(file)).expect("a file of the run");
            assert!(read("whole") == read(signal), "{signal}: {file} differs");
        }
        assert!(!tree(&d.join(signal)).iter().any(|name| name.ends_with(".tmp")));
    }
}

#[test]
fn a_reproduction_resumes_after_a_signal() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let args =
        |out: &'static str| ["reproduce", "ball", "--iterations", "12", "--test-drops", "2", "--out", out];
    run(&args("whole"), d);
    let child = start(&args("stopped"), d);
    wait_until(|| std::fs::metadata(d.join("stopped/neural/metrics.jsonl")).is_ok());
    let error = stop(child, "TERM", 143, &args("stopped"));
    assert!(error.contains("interrupted after iteration"), "{error}");
    assert!(d.join("stopped/neural/checkpoint.bin").exists() && !d.join("stopped/result.json").exists());
    run(&[&args("stopped")[..], &["--resume"]].concat(), d);
    for file in ["result.json", "report.html", "run.toml", "hybrid-plus/checkpoint.bin"] {
        let read = |run: &str| std::fs::read(d.join(run).join(file)).expect("a file of the run");
        assert!(read("whole") == read("stopped"), "{file} differs");
    }
}
