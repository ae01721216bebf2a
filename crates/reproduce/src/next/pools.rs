//! Pools of recorded runs with the explanations that the literature offers for them.

use augsim_data::{DataError, Dataset, Trajectory};
use augsim_session::DataFrom;
use augsim_session::equations::records::{read, records};
use augsim_session::next::Source;
use augsim_system::Record;
use std::path::{Path, PathBuf};

/// A pool of recorded runs, and explanations of it with their free parameters.
#[derive(Debug)]
pub struct Pool {
    /// Name of the pool.
    pub name: String,
    /// The recorded runs.
    pub runs: Vec<Record>,
    /// The explanations, not yet calibrated.
    pub explanations: Vec<Source>,
}

/// A built-in pool: where its data are, and how they are divided into runs.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Folder of the data set.
    pub folder: &'static str,
    /// Group of recordings that makes the pool; all recordings if empty.
    group: &'static str,
    /// Group of recordings that is left out, since its input is not recorded.
    without: &'static str,
    /// Number of runs of equal duration into which each recording is cut.
    parts: usize,
    /// Names and texts of the model files.
    explanations: &'static [(&'static str, &'static str)],
}

const SERVO: &[(&str, &str)] = &[
    ("viscous", include_str!("../../models/next/servo-viscous.toml")),
    ("Coulomb", include_str!("../../models/next/servo-coulomb.toml")),
    ("Stribeck", include_str!("../../models/next/servo-stribeck.toml")),
    ("load-dependent", include_str!("../../models/next/servo-load.toml")),
];
const SEAL: &[(&str, &str)] = &[
    ("viscous", include_str!("../../models/next/seal-viscous.toml")),
    ("Coulomb", include_str!("../../models/next/seal-coulomb.toml")),
    ("Stribeck", include_str!("../../models/next/seal-stribeck.toml")),
    ("pressure-dependent", include_str!("../../models/next/seal-pressure.toml")),
];

/// Ten strokes of a cylinder with one shape of seal are ten runs.
const fn seal(group: &'static str) -> Known {
    Known { folder: "pneumatic-seal-friction", group, without: "", parts: 10, explanations: SEAL }
}

/// All built-in pools. In the drops of the servo its command is switched off, so they are left out.
pub const KNOWN: [Known; 5] = [
    Known { folder: "servo-horn", group: "", without: "drop", parts: 1, explanations: SERVO },
    seal("Circle"),
    seal("KDN"),
    seal("NAPN"),
    seal("Stadium"),
];

impl Known {
    /// Name of the pool.
    pub fn name(&self) -> String {
        if self.group.is_empty() { self.folder.to_owned() } else { format!("{} {}", self.folder, self.group) }
    }

    /// Reads the pool from the folder of all data sets.
    ///
    /// # Errors
    /// The data cannot be read.
    pub fn read(&self, data: &Path) -> anyhow::Result<Pool> {
        let source = |(name, text): &(&str, &str)| -> anyhow::Result<Source> {
            let model = augsim_equations::model::parse(text, name)?;
            Ok(Source::new(*name, model))
        };
        let explanations: Vec<Source> = self.explanations.iter().map(source).collect::<Result<_, _>>()?;
        let path = data.join(self.folder).join("data.csv.gz");
        let model = &explanations[0].model;
        let all = read(DataFrom::with_time(&path, None), model)?.data;
        let is_wanted = |t: &&Trajectory| {
            let group = t.group().unwrap_or_default();
            (self.group.is_empty() || group == self.group)
                && (self.without.is_empty() || group != self.without)
        };
        let kept = all.trajectories().iter().filter(is_wanted).map(|t| cut(t, self.parts));
        let kept: Vec<Trajectory> = kept.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        let runs = records(&all.with_trajectories(kept)?, model, true)?;
        Ok(Pool { name: self.name(), runs, explanations })
    }
}

/// Reads a pool of the user, with the model files of its explanations.
///
/// # Errors
/// The recordings or a model cannot be read, or the explanations have different columns.
pub fn read_pool(pool: &Path, explanations: &[PathBuf]) -> anyhow::Result<Pool> {
    let explanations = augsim_session::next::sources(explanations)?;
    let model = &explanations[0].model;
    let data: Dataset = read(DataFrom::of_paths(&[pool.to_owned()], None), model)?.data;
    let name =
        pool.file_name().map_or_else(|| pool.display().to_string(), |n| n.to_string_lossy().into_owned());
    Ok(Pool { name, runs: records(&data, model, true)?, explanations })
}

/// Cuts a trajectory into parts of equal numbers of samples, each with its own time.
fn cut(t: &Trajectory, parts: usize) -> Result<Vec<Trajectory>, DataError> {
    if parts == 1 {
        return Ok(vec![t.clone()]);
    }
    let part = |k: usize| {
        let range = k * t.len() / parts..(k + 1) * t.len() / parts;
        let times = t.time_s()[range.clone()].iter().map(|time| time - t.time_s()[range.start]).collect();
        let values = t.values().iter().map(|column| column[range.clone()].to_vec()).collect();
        let id = format!("{}-{}", t.id(), k + 1);
        Trajectory::new(id, times, values)?.with_group(t.group().unwrap_or_default().to_owned())
    };
    (0..parts).map(part).collect()
}
