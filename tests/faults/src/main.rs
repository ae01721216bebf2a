//! Disturbs `train`, `discover`, `predict`, `convert` and `reproduce`: kills them at random system calls, fills their
//! disk, forbids writing. Afterwards every file must be whole or absent, and the same command (with `--resume` where
//! there is one) must end with the bytes of an undisturbed run.
//!
//! ```sh
//! cargo build --release && cargo run --release -p augsim-faults            # 30 kills of each command
//! cargo run --release -p augsim-faults -- --kills 4 --disks 2              # as in .ci/run
//! ```
//!
//! Kills need strace, full and read-only disks the right to mount. Places are drawn from the seed; the work of threads is
//! not in step, so the same place may be another moment.

mod attack;
mod outputs;
mod run;
mod scene;
mod tiny_disk;

use anyhow::Context;
use attack::{OUT, Target, fresh};
use augsim_data::random_stream;
use clap::Parser;
use rand::RngExt;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use tiny_disk::TinyDisk;

/// Disturbs augsim's commands and looks at what is left.
#[derive(Parser)]
struct Args {
    /// Kills of each command.
    #[arg(long, default_value_t = 30)]
    kills: u64,
    /// Full disks for each command.
    #[arg(long, default_value_t = 10)]
    disks: u64,
    /// Seed of the places.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One command only.
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
    anyhow::ensure!(known, "no such command; there are {}", names.join(", "));
    let folder = root.path().join("case");
    fresh(&folder)?;
    let mountable = TinyDisk::is_possible(&folder);
    if !mountable {
        writeln!(out, "NOT RUN: full and read-only disks, because this user may not mount")?;
    }
    let mut defects = 0;
    for scene in scenes.iter().filter(|s| args.scene.as_deref().is_none_or(|name| name == s.name)) {
        let (done, found) = disturb(&args, &augsim, scene, root.path(), mountable, &mut out)
            .with_context(|| format!("{}: the harness failed", scene.name))?;
        writeln!(out, "{:10} disturbed {done} times, {found} defects", scene.name)?;
        defects += found;
    }
    Ok(if defects == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// All disturbances of one command: how many there were, and how many showed a defect.
fn disturb(
    args: &Args,
    augsim: &Path,
    scene: &scene::Scene,
    root: &Path,
    mountable: bool,
    out: &mut impl Write,
) -> anyhow::Result<(u64, u64)> {
    let folder = root.join("case");
    fresh(&folder)?;
    let ended = run::run(augsim, &scene.arguments, &folder)?;
    anyhow::ensure!(ended.code == Some(0), "undisturbed it fails: {}", ended.stderr);
    let undisturbed = outputs::files(&folder.join(OUT))?;
    let size: usize = undisturbed.values().map(Vec::len).sum();
    let target = Target { augsim, scene, undisturbed };

    let mut calls = Vec::new();
    for set in ["all", run::CHANGING] {
        fresh(&folder)?;
        calls.push(run::places(augsim, &scene.arguments, &folder, set)?);
    }
    let mut rng = random_stream(args.seed, scene.name, 0);
    let (mut done, mut found) = (0, 0);
    let mut note = |what: String, outcome: Option<String>| {
        done += 1;
        if let Some(defect) = outcome {
            found += 1;
            writeln!(out, "{}: {what}: {defect}", scene.name)?;
        }
        anyhow::Ok(())
    };
    for kill in 0..args.kills {
        let changing = kill % 2 == 1;
        let places = &calls[usize::from(changing)];
        let place = places[rng.random_range(0..places.len())];
        fresh(&folder)?;
        let set = if changing { "changing call" } else { "call" };
        note(format!("killed at {set} {place}"), target.killed(&folder, changing, place)?)?;
    }
    if mountable {
        for _ in 0..args.disks {
            // From nothing at all to nearly all that is needed, in pages.
            let room = 4 * rng.random_range(1..=(size as u64 / 4096).max(1));
            fresh(&folder)?;
            note(format!("a disk of {room} KiB"), target.full_disk(&folder, room)?)?;
        }
        fresh(&folder)?;
        note("a read-only disk".to_owned(), target.read_only(&folder)?)?;
    }
    Ok((done, found))
}
