//! Contract: the same command with the same seed writes the same bytes into any folder, except
//! `timing.json`. The command on the page has every option that was used.

use crate::command::succeed;
use std::path::{Path, PathBuf};

const SEALED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/sealed");

/// Returns the relative paths of the files in a folder.
fn files(dir: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(dir).expect("a folder").flatten() {
        let name = PathBuf::from(entry.file_name());
        match entry.path().is_dir() {
            true => all.extend(files(&entry.path()).into_iter().map(|inner| name.join(inner))),
            false => all.push(name),
        }
    }
    all.sort();
    all
}

/// Runs a command twice, with different folders and numbers of threads, and compares the written files; returns the first folder.
pub fn writes_the_same(args: &[&str], dir: &Path) -> PathBuf {
    let (one, other) = ("first", "other/and deeper/folder");
    for (out, threads) in [(one, "1"), (other, "3")] {
        succeed(&[args, &["--out", out, "--threads", threads]].concat(), dir);
    }
    let (one, other) = (dir.join(one), dir.join(other));
    let all = files(&one);
    assert_eq!(all, files(&other));
    assert!(all.len() > 2, "{all:?}");
    for file in all.iter().filter(|file| !file.ends_with("timing.json")) {
        // The record of a run ends with the paths of its inputs as seen from its folder.
        let read = |folder: &PathBuf| {
            let bytes = std::fs::read(folder.join(file)).expect("a file");
            let paths =
                String::from_utf8_lossy(&bytes).find("[paths]").filter(|_| file.ends_with("run.toml"));
            bytes[..paths.unwrap_or(bytes.len())].to_vec()
        };
        let [a, b] = [&one, &other].map(read);
        assert!(a == b, "{args:?}: {} differs", file.display());
    }
    one
}

fn page(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("report.html")).expect("a page")
}

#[test]
fn discovery_is_reproducible_and_its_page_lists_every_option() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let sealed = std::fs::read_to_string(Path::new(SEALED).join("bounces.csv")).expect("the sealed set");
    let grouped: String = sealed
        .lines()
        .enumerate()
        .map(|(i, line)| format!("{line},{}\n", if i == 0 { "group" } else { "red ball" }))
        .collect();
    std::fs::write(d.join("my data.csv"), grouped).expect("it can be written");
    std::fs::copy(Path::new(SEALED).join("model.toml"), d.join("model.toml")).expect("it can be copied");
    let args = ["discover", "model.toml", "my data.csv", "--group", "red ball", "--null-runs", "3"];
    let out = writes_the_same(&[&args[..], &["--seed", "7"]].concat(), d);
    let text = page(&out).replace("&quot;", "\"").replace("&#39;", "'");
    let command =
        "augsim discover model.toml 'my data.csv' --null-runs 3 --group 'red ball' --seed 7 --out DIR";
    assert!(text.contains(command), "the page has no `{command}`");
    assert!(!text.contains("time of the run"));
    let timing = std::fs::read_to_string(out.join("timing.json")).expect("times");
    let timing: serde_json::Value = serde_json::from_str(&timing).expect("JSON");
    assert!(timing["seconds"].as_f64().expect("a number") > 0.0);
}

#[test]
fn training_and_evaluation_are_reproducible() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["simulate", "--trajectories", "12", "--samples", "40", "--out", "d.csv"], d);
    writes_the_same(&["train", "--pybullet-ball", "--data", "d.csv", "--iterations", "20", "--seed", "3"], d);
    let score = |run: &str| succeed(&["evaluate", run, "--data", "d.csv", "--json"], d);
    assert!(score("first") == score("other/and deeper/folder"));
}

#[test]
fn reproduction_is_reproducible_and_its_page_lists_every_option() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let args = ["reproduce", "ball", "--iterations", "3", "--test-drops", "4", "--seed", "5"];
    let out = writes_the_same(&args, dir.path());
    let text = page(&out);
    assert!(text.contains("augsim reproduce ball --iterations 3 --seed 5 --test-drops 4 --out DIR"));
    assert!(!text.contains("time per iteration"));
    let timing = std::fs::read_to_string(out.join("timing.json")).expect("times");
    let timing: serde_json::Value = serde_json::from_str(&timing).expect("JSON");
    assert!(timing["seconds_per_iteration"]["Hybrid+"].as_f64().expect("a number") > 0.0);
}
