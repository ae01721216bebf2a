//! Fault injection for `train`, `discover`, `predict`, `convert` and `reproduce`.
//!
//! The commands are killed at random system calls, and run on full and read-only disks. Afterwards every file
//! must be complete or absent, and the same command (with `--resume` if it has that) must finish with the
//! bytes of an undisturbed run.
//!
//! ```sh
//! cargo build --release && cargo run --release -p augsim-faults            # 30 kills per command
//! cargo run --release -p augsim-faults -- --kills 4 --disks 2              # as in .ci/run
//! ```
//!
//! Kills need strace; full and read-only disks need the right to mount. The system calls are drawn from the
//! seed. Threads are not synchronised, so the same call may be another moment of the run.

mod attack;
mod outputs;
mod run;
mod scene;
mod tiny_disk;

use anyhow::Context;
use attack::{OUT, Target, empty_folder};
use augsim_data::random_stream;
use clap::Parser;
use rand::RngExt;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use tiny_disk::TinyDisk;

/// Disturbs augsim's commands and checks the files that remain.
#[derive(Parser)]
struct Args {
    /// Kills per command.
    #[arg(long, default_value_t = 30)]
    kills: u64,
    /// Full disks per command.
    #[arg(long, default_value_t = 10)]
    disks: u64,
    /// Seed of the system calls and disk sizes.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Test this command only.
    #[arg(long)]
    scene: Option<String>,
}

fn main() -> anyhow::Result<ExitCode> {
    let args = Args::parse();
    let augsim = scene::augsim()?;
    let root = tempfile::tempdir()?;
    let mut out = std::io::stdout();
    let scenes = scene::prepare(&augsim, root.path())?;
    let names: Vec<&str> = scenes.iter().map(|s| s.name).collect();
    let known = args.scene.as_deref().is_none_or(|name| names.contains(&name));
    anyhow::ensure!(known, "there is no such command; choose one of {}", names.join(", "));
    let folder = root.path().join("case");
    empty_folder(&folder)?;
    let can_mount = TinyDisk::can_mount(&folder);
    if !can_mount {
        writeln!(out, "NOT RUN: full and read-only disks, because this user may not mount file systems")?;
    }
    let mut defects = 0;
    for scene in scenes.iter().filter(|s| args.scene.as_deref().is_none_or(|name| name == s.name)) {
        let (disturbances, defects_found) = disturb(&args, &augsim, scene, root.path(), can_mount, &mut out)
            .with_context(|| format!("{}: the harness failed", scene.name))?;
        writeln!(out, "{:10} disturbed {disturbances} times, {defects_found} defects", scene.name)?;
        defects += defects_found;
    }
    Ok(if defects == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Injects all faults into one command; returns the numbers of injected faults and of defects.
fn disturb(
    args: &Args,
    augsim: &Path,
    scene: &scene::Scene,
    root: &Path,
    can_mount: bool,
    out: &mut impl Write,
) -> anyhow::Result<(u64, u64)> {
    let folder = root.join("case");
    empty_folder(&folder)?;
    let ended = run::run(augsim, &scene.arguments, &folder)?;
    anyhow::ensure!(ended.code == Some(0), "the undisturbed command fails: {}", ended.stderr);
    let undisturbed = outputs::files(&folder.join(OUT))?;
    let size: usize = undisturbed.values().map(Vec::len).sum();
    let target = Target { augsim, scene, undisturbed };

    let mut calls = Vec::new();
    for set in ["all", run::CHANGING] {
        empty_folder(&folder)?;
        calls.push(run::places(augsim, &scene.arguments, &folder, set)?);
    }
    let mut rng = random_stream(args.seed, scene.name, 0);
    let (mut disturbances, mut defects_found) = (0, 0);
    let mut note = |what: String, outcome: Option<String>| {
        disturbances += 1;
        if let Some(defect) = outcome {
            defects_found += 1;
            writeln!(out, "{}: {what}: {defect}", scene.name)?;
        }
        anyhow::Ok(())
    };
    for kill in 0..args.kills {
        let changing = kill % 2 == 1;
        let places = &calls[usize::from(changing)];
        let place = places[rng.random_range(0..places.len())];
        empty_folder(&folder)?;
        let set = if changing { "changing call" } else { "call" };
        note(format!("killed at {set} {place}"), target.killed(&folder, changing, place)?)?;
    }
    if can_mount {
        for _ in 0..args.disks {
            // From almost nothing to almost the space needed, in pages.
            let room = 4 * rng.random_range(1..=(size as u64 / 4096).max(1));
            empty_folder(&folder)?;
            note(format!("a disk of {room} KiB"), target.full_disk(&folder, room)?)?;
        }
        empty_folder(&folder)?;
        note("a read-only disk".to_owned(), target.read_only(&folder)?)?;
    }
    Ok((disturbances, defects_found))
}
