//! Discovery on all measured data sets of a folder.

use crate::measured::{self, NULL_RUNS};
use anyhow::Context;
use augsim_data::convert::{CONVERTERS, holds_pushes};
use augsim_data::{Dataset, MissingCells, atomic_write, read_dataset, write_dataset};
use augsim_discovery::Discovery;
use augsim_session::folders;
use augsim_terminal::destination::{REPORT, RESULT};
use augsim_terminal::discover_args::Discover;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Folder name of the data set of ball drops that PyBullet simulated.
pub const PYBULLET: &str = "pybullet-ball";

/// Model file of the PyBullet drops: damping that the data do not have, and a restitution of 0.65.
///
/// The position noise is a tolerance, because the stepping scheme differs from the exact engine by
/// centimetres at each bounce.
const PYBULLET_MODEL: &str = "\
scenario = \"ball\"

[parameters]
gravity_m_s2 = { nominal = 9.8, frozen = true }
restitution = { nominal = 0.65, min = 0.0, max = 1.0 }

[sensor]
position_sd_m = 0.03

[release]
kind = \"rest\"

[[effect]]
kind = \"linear-drag\"
c_per_s = 0.04

[[effect]]
kind = \"quadratic-drag\"
k_per_m = 0.04
";
/// Number of PyBullet drops that the discovery reads; more do not change the result.
const PYBULLET_DROPS: usize = 100;

/// A data set and the result of the discovery on it.
#[derive(Debug, Serialize)]
pub struct SetRow {
    /// Name of the data set.
    pub set: String,
    /// Number of trajectories that the discovery read.
    pub trajectories: usize,
    /// Path of the discovery's report, relative to the results folder.
    pub report: PathBuf,
    /// Result of the discovery.
    #[serde(flatten)]
    pub found: Discovery,
}

/// Runs the discovery on the ball data sets in `data`, each in a separate folder of `out`.
pub fn run(data: &Path, out: &Path, seed: u64, output: &Output) -> anyhow::Result<Vec<SetRow>> {
    let mut rows = Vec::new();
    for (set, convert) in CONVERTERS.into_iter().filter(|(set, _)| !holds_pushes(set)) {
        let folder = data.join(set);
        if !folder.exists() {
            output.note(format!("{}: not found, skipped", folder.display()));
            continue;
        }
        let converted = convert(&folder)?;
        if let Some(model) = converted.model_toml {
            rows.push(discover_set(set, &converted.data, &model, out, seed, false, output)?);
        }
    }
    let drops = data.join(PYBULLET).join("train.csv.gz");
    if drops.exists() {
        let all = read_dataset(&drops, MissingCells::Refuse)?;
        let some = all.trajectories().iter().take(PYBULLET_DROPS).cloned().collect();
        let some = Dataset::new(all.columns().to_vec(), some)?;
        rows.push(discover_set(PYBULLET, &some, PYBULLET_MODEL, out, seed, false, output)?);
    }
    Ok(rows)
}

/// Runs the discovery on one set in a separate folder of `out`.
///
/// With `resume` an existing result from the same model and data is reused; this is for data that depend on
/// the seed.
pub fn discover_set(
    set: &str,
    data: &Dataset,
    model: &str,
    out: &Path,
    seed: u64,
    resume: bool,
    output: &Output,
) -> anyhow::Result<SetRow> {
    let out = out.join(set);
    folders::make(&out)?;
    let args = Discover {
        model: out.join("declared.toml"),
        data: vec![out.join("data.csv.gz")],
        out: out.clone(),
        null_runs: NULL_RUNS,
        ..Discover::default()
    };
    output.note(format!("{set}: {} trajectories", data.trajectories().len()));
    let found = match resume.then(|| earlier(&args, data, model)).flatten() {
        Some(found) => {
            output.note(format!("{set}: {}", found.sentence));
            found
        }
        None => {
            // Remove a result from other data first, so that it does not remain if this run is
            // interrupted.
            let result = out.join(RESULT);
            if result.exists() {
                std::fs::remove_file(&result)
                    .with_context(|| format!("{}: cannot remove it", result.display()))?;
            }
            atomic_write(&args.model, |w| w.write_all(model.as_bytes()))?;
            write_dataset(data, &args.data[0])?;
            measured::discover_set(set, &args, seed, output)?
        }
    };
    let trajectories = data.trajectories().len();
    Ok(SetRow { set: set.to_owned(), trajectories, report: Path::new(set).join(REPORT), found })
}

/// Returns the result of an earlier discovery; `None` if there is none for the same model and data.
fn earlier(args: &Discover, data: &Dataset, model: &str) -> Option<Discovery> {
    let same_model = std::fs::read_to_string(&args.model).ok()? == model;
    let before = read_dataset(args.data.first()?, MissingCells::AsGap).ok()?;
    let same =
        same_model && before.columns() == data.columns() && before.trajectories() == data.trajectories();
    let text = std::fs::read_to_string(args.out.join(RESULT)).ok()?;
    serde_json::from_str(&text).ok().filter(|_| same)
}
