//! The `augsim` commands into which faults are injected.
//!
//! Each command runs in its own folder, writes only to `out`, and is repeated with the same arguments, with
//! `--resume` if the command has it.

use crate::run::run;
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// A command under test, and how it is resumed after it was killed.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Name of the command in reports.
    pub name: &'static str,
    /// Arguments of the command's first run.
    pub arguments: Vec<String>,
    /// Arguments with which the command is repeated or resumed.
    pub again: Vec<String>,
}

/// Path of the folder of common input files, relative to the folder of a test case.
const INPUTS: &str = "../inputs";

/// Makes the input files below `root` and returns the commands under test that use them.
///
/// # Errors
/// The inputs cannot be made.
pub fn prepare(augsim: &Path, root: &Path) -> anyhow::Result<Vec<Scene>> {
    let inputs = root.join("inputs");
    fs::create_dir_all(&inputs)?;
    let fixtures = workspace().join("fixtures");
    let copy = |from: &str, to: &str| {
        let from = fixtures.join(from);
        fs::copy(&from, inputs.join(to)).with_context(|| from.display().to_string())
    };
    copy("sealed/model.toml", "model.toml")?;
    // Both trials of the fixture, in the layout of the published data.
    fs::create_dir_all(inputs.join("pushes"))?;
    for entry in fs::read_dir(fixtures.join("mit-push"))? {
        let path = entry?.path();
        if let Some(name) = path.file_name().filter(|_| path.extension().is_some_and(|e| e == "h5")) {
            fs::copy(&path, inputs.join("pushes").join(name))?;
        }
    }
    let bounces = fs::read_to_string(fixtures.join("sealed/bounces.csv"))?;
    fs::write(inputs.join("bounces.csv"), trajectories(&bounces, 12))?;
    let simulate = arguments_of("simulate --trajectories 40 --samples 80 --out ball.csv --seed 5");
    anyhow::ensure!(run(augsim, &simulate, &inputs)?.code == Some(0), "augsim simulate failed");
    let train = "train --pybullet-ball --data ../inputs/ball.csv --recipe hybrid --iterations 6 --checkpoint-every 2 --threads 2";
    let net = arguments_of(&format!("{train} --out net").replace("../inputs/", ""));
    anyhow::ensure!(run(augsim, &net, &inputs)?.code == Some(0), "augsim train failed");

    let scene = |name, arguments: &str, again: &str| Scene {
        name,
        arguments: arguments_of(&arguments.replace("../inputs", INPUTS)),
        again: arguments_of(&format!("{arguments} {again}").replace("../inputs", INPUTS)),
    };
    Ok(vec![
        scene("train", &format!("{train} --out out"), "--resume"),
        scene("discover", "discover ../inputs/model.toml ../inputs/bounces.csv --out out --seed 3", ""),
        scene(
            "predict",
            "predict ../inputs/net --data ../inputs/ball.csv --samples 20 --out out/forecast.csv",
            "",
        ),
        scene("convert", "data convert mit-push ../inputs/pushes out/pushes.csv", ""),
        scene("reproduce", "reproduce ball --iterations 2 --test-drops 2 --seed 3 --out out", "--resume"),
    ])
}

/// Path of the program `augsim`, which cargo puts into the same folder as this program.
///
/// # Errors
/// The program does not exist.
pub fn augsim() -> anyhow::Result<PathBuf> {
    let path = env::current_exe()?.with_file_name("augsim");
    anyhow::ensure!(path.is_file(), "{} is missing; run `cargo build --release` first", path.display());
    Ok(path)
}

/// Path of the root folder of the workspace.
fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Splits a command line at white space into arguments.
fn arguments_of(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_owned).collect()
}

/// Copies the header and the first `count` trajectories of a CSV file in long form.
fn trajectories(text: &str, count: usize) -> String {
    let mut ids: Vec<&str> = Vec::new();
    let mut out = String::new();
    for line in text.lines() {
        let id = line.split(',').next().unwrap_or_default();
        if !ids.contains(&id) {
            ids.push(id);
        }
        // The first cell of the header counts as one.
        if ids.len() > count + 1 {
            break;
        }
        out.push_str(line);
        out.push('\n');
    }
    out
}
