//! The run directory: `config.resolved.toml`, `metrics.jsonl`, `checkpoint.bin`, `weights.safetensors`.

use crate::Usage;
use crate::usage::{Difference, PathFault};
use anyhow::Context;
use augsim_data::atomic_write;
use augsim_data::checks::Check;
use augsim_nn::{Params, checkpoint, weights};
use augsim_trainer::{Losses, Settings, TrainingState};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

/// Where training data come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DataSource {
    /// A file.
    File(PathBuf),
    /// A table in memory, of which only name and fingerprint are stored.
    Table {
        /// Name.
        name: String,
        /// Fingerprint: checksum and size.
        content: String,
    },
    /// Generated from the paper's law.
    #[serde(rename = "paper-law")]
    DropDistribution {
        /// Number of trajectories.
        trajectories: usize,
        /// Seed of the draws.
        seed: u64,
    },
    /// The first pushes of an MIT layout in the virtual laboratory.
    PushLaboratory {
        /// Object.
        object: String,
        /// Support sheet.
        surface: String,
        /// Number of pushes, for training and tests.
        pushes: usize,
        /// Seed of the draws.
        seed: u64,
    },
}

/// Content of `config.resolved.toml`: enough to repeat the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Iterations between checkpoints.
    pub checkpoint_every: u64,
    /// Data checks that the user skipped.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accept: Vec<Check>,
    /// Folder of the discovery whose augmented model the net corrects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_of: Option<PathBuf>,
    /// Training data.
    pub data: DataSource,
    /// Settings of the run.
    pub settings: Settings,
}

/// Name of the file with the settings.
pub const CONFIG: &str = "config.resolved.toml";
/// Name of the file from which training resumes.
pub const CHECKPOINT: &str = "checkpoint.bin";
const WEIGHTS: &str = "weights.safetensors";
/// Name of the file with the losses.
pub const METRICS: &str = "metrics.jsonl";
/// Names of all files that training writes.
pub const FILES: [&str; 4] = [CONFIG, CHECKPOINT, WEIGHTS, METRICS];

/// A run directory.
#[derive(Debug, Clone)]
pub struct RunDir(PathBuf);

impl RunDir {
    /// A run directory at a path; nothing is read.
    pub fn open(path: &Path) -> Self {
        RunDir(path.to_owned())
    }

    /// Path of a file in the directory.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Path of the checkpoint.
    pub fn checkpoint(&self) -> PathBuf {
        self.file(CHECKPOINT)
    }

    /// Removes the files of an earlier run.
    ///
    /// The checkpoint goes first, so that an interrupted removal leaves nothing that could be resumed.
    pub fn clear(&self) -> anyhow::Result<()> {
        for name in [CHECKPOINT, WEIGHTS, METRICS, CONFIG] {
            let path = self.file(name);
            match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    return Err(e).with_context(|| format!("{}: cannot be removed", path.display()));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Writes the checkpoint.
    pub fn write_checkpoint(&self, state: &TrainingState) -> anyhow::Result<()> {
        let bytes = checkpoint::encode(state)?;
        atomic_write(&self.checkpoint(), |w| w.write_all(&bytes))?;
        Ok(())
    }

    /// Writes the weights as safetensors, for other programs.
    pub fn write_weights(&self, params: &Params<f32>) -> anyhow::Result<()> {
        let bytes = weights::encode(params)?;
        atomic_write(&self.file(WEIGHTS), |w| w.write_all(&bytes))?;
        Ok(())
    }

    /// Writes the configuration.
    pub fn write_config(&self, config: &Config) -> anyhow::Result<()> {
        let text = toml::to_string_pretty(config)?;
        atomic_write(&self.file(CONFIG), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Reads the configuration.
    pub fn read_config(&self) -> anyhow::Result<Config> {
        let path = self.file(CONFIG);
        let text = std::fs::read_to_string(&path).with_context(|| {
            format!("{}: cannot be read; give the run directory that `train` wrote", path.display())
        })?;
        toml::from_str(&text).with_context(|| {
            format!(
                "{}: is not a configuration of this version of augsim; train a run of an earlier version again",
                path.display()
            )
        })
    }

    /// Reads the last checkpoint; `None` if there is none.
    pub fn read_checkpoint(&self) -> anyhow::Result<Option<TrainingState>> {
        if !self.checkpoint().exists() {
            return Ok(None);
        }
        self.read_model().map(Some)
    }

    /// Reads the trained model.
    ///
    /// # Errors
    /// The checkpoint cannot be read, or the configuration was edited since and does not describe the
    /// weights.
    pub fn read_model(&self) -> anyhow::Result<TrainingState> {
        let state: TrainingState = checkpoint::load(&self.checkpoint())?;
        if self.file(CONFIG).exists() {
            self.check_settings(&self.read_config()?.settings, &state.settings)?;
        }
        Ok(state)
    }

    /// Checks that a run to be resumed has this configuration.
    ///
    /// # Errors
    /// It has another one; the message names the first key that differs.
    pub fn check_config(&self, wanted: &Config) -> anyhow::Result<()> {
        let stored = self.read_config()?;
        if stored == *wanted {
            return Ok(());
        }
        let [stored, wanted] = [&stored, wanted].map(toml::Value::try_from);
        let (key, there, here) = difference("", &stored?, &wanted?);
        let key = key.trim_start_matches('.').to_owned();
        let difference = Difference { key, there, here };
        Err(Usage::path(&self.file(CONFIG), PathFault::OtherSettings { difference }).into())
    }

    /// Checks that the settings of the configuration are those of the checkpoint.
    fn check_settings(&self, written: &Settings, trained: &Settings) -> anyhow::Result<()> {
        if written == trained {
            return Ok(());
        }
        let [written, trained] = [written, trained].map(toml::Value::try_from);
        let (key, there, here) = difference("settings", &written?, &trained?);
        let difference = Difference { key, there, here };
        Err(Usage::path(&self.file(CONFIG), PathFault::EditedSettings { difference }).into())
    }

    /// Opens the metrics file for appending, and drops the lines after `iteration`.
    ///
    /// Lines that a killed process wrote after its last checkpoint are written again, with identical content.
    pub fn metrics_after(&self, iteration: u64) -> anyhow::Result<Metrics> {
        let path = self.file(METRICS);
        let valid_lines = read_metrics(&path)?.into_iter().filter(|l| l.iteration <= iteration);
        let mut text = String::new();
        for losses in valid_lines {
            text.push_str(&serde_json::to_string(&losses)?);
            text.push('\n');
        }
        atomic_write(&path, |w| w.write_all(text.as_bytes()))?;
        let unwritable = || format!("{}: cannot be written", path.display());
        let file = File::options().append(true).open(&path).with_context(unwritable)?;
        Ok(Metrics { file, path, length: text.len() as u64 })
    }

    /// All losses logged so far.
    pub fn read_metrics(&self) -> anyhow::Result<Vec<Losses>> {
        read_metrics(&self.file(METRICS))
    }
}

/// Key and both values of the first difference, in the order of the file.
pub fn difference(key: &str, one: &toml::Value, other: &toml::Value) -> (String, String, String) {
    if let (Some(one), Some(other)) = (one.as_table(), other.as_table()) {
        let absent = toml::Value::String("absent".to_owned());
        for name in one.keys().chain(other.keys()) {
            let [a, b] = [one, other].map(|table| table.get(name).unwrap_or(&absent));
            if a != b {
                return difference(&format!("{key}.{name}"), a, b);
            }
        }
    }
    (key.to_owned(), one.to_string(), other.to_string())
}

/// Complete lines of a metrics file; a truncated last line is dropped.
fn read_metrics(path: &Path) -> anyhow::Result<Vec<Losses>> {
    let Ok(file) = File::open(path) else { return Ok(Vec::new()) };
    let mut lines = Vec::new();
    for line in BufReader::new(file).lines() {
        match serde_json::from_str(&line?) {
            Ok(losses) => lines.push(losses),
            Err(_) => break,
        }
    }
    Ok(lines)
}

/// The metrics file, one JSON object per line.
#[derive(Debug)]
pub struct Metrics {
    file: File,
    path: PathBuf,
    /// Size of the complete lines, bytes.
    length: u64,
}

impl Metrics {
    /// Appends a line; on failure the file is left unchanged.
    pub fn push(&mut self, losses: &Losses) -> anyhow::Result<()> {
        let line = serde_json::to_string(losses)? + "\n";
        let written = self.file.write_all(line.as_bytes());
        if written.is_err() {
            // A full disk may take part of the line, which is cut off again. The error to report is that of
            // writing.
            let _ = self.file.set_len(self.length);
        }
        written.with_context(|| {
            format!("{}: cannot be written; free some disk space and resume", self.path.display())
        })?;
        self.length += line.len() as u64;
        Ok(())
    }
}
