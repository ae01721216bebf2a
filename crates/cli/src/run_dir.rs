//! The run directory: `config.resolved.toml`, `metrics.jsonl`, `checkpoint.bin`, `weights.safetensors`.

use anyhow::Context;
use augsim_data::atomic_write;
use augsim_data::checks::Check;
use augsim_trainer::{Losses, Settings, TrainingState};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Where training data come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DataSource {
    /// A file.
    File(PathBuf),
    /// Generated from the paper's law.
    PaperLaw {
        /// Number of trajectories.
        trajectories: usize,
        /// Seed of the draws.
        seed: u64,
    },
    /// The first pushes of an MIT layout in the virtual laboratory.
    PushLaboratory {
        /// Object.
        object: String,
        /// Support.
        surface: String,
        /// Pushes that were made, for training and tests.
        pushes: usize,
        /// Seed of the draws.
        seed: u64,
    },
}

/// What `config.resolved.toml` holds: enough to repeat the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Iterations between checkpoints.
    pub checkpoint_every: u64,
    /// Checks of suspicious data that the user did without.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accept: Vec<Check>,
    /// Training data.
    pub data: DataSource,
    /// Settings of the run.
    pub settings: Settings,
}

/// A run directory.
#[derive(Debug, Clone)]
pub struct RunDir(PathBuf);

impl RunDir {
    /// The directory, which is made if it is absent.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(path)
            .with_context(|| format!("{}: cannot make the run directory", path.display()))?;
        Ok(RunDir(path.to_owned()))
    }

    /// An existing directory.
    pub fn open(path: &Path) -> Self {
        RunDir(path.to_owned())
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Path of the checkpoint.
    pub fn checkpoint(&self) -> PathBuf {
        self.file("checkpoint.bin")
    }

    /// Writes the configuration.
    pub fn write_config(&self, config: &Config) -> anyhow::Result<()> {
        let text = toml::to_string_pretty(config)?;
        atomic_write(&self.file("config.resolved.toml"), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Reads the configuration.
    pub fn read_config(&self) -> anyhow::Result<Config> {
        let path = self.file("config.resolved.toml");
        let text = std::fs::read_to_string(&path).with_context(|| {
            format!("{}: cannot read it; give the run directory of `train`", path.display())
        })?;
        toml::from_str(&text).with_context(|| format!("{}: not a configuration of augsim", path.display()))
    }

    /// The last checkpoint, if there is one.
    pub fn read_checkpoint(&self) -> anyhow::Result<Option<TrainingState>> {
        let path = self.checkpoint();
        if !path.exists() {
            return Ok(None);
        }
        Ok(Some(augsim_nn::checkpoint::load(&path)?))
    }

    /// The finished model.
    pub fn read_model(&self) -> anyhow::Result<TrainingState> {
        Ok(augsim_nn::checkpoint::load(&self.checkpoint())?)
    }

    /// Opens the metrics file for appending, after dropping what comes after `iteration`: lines that a
    /// killed process wrote beyond its last checkpoint are written again, the same.
    pub fn metrics_after(&self, iteration: u64) -> anyhow::Result<Metrics> {
        let path = self.file("metrics.jsonl");
        let kept = read_metrics(&path)?.into_iter().filter(|l| l.iteration <= iteration);
        let mut text = String::new();
        for losses in kept {
            text.push_str(&serde_json::to_string(&losses)?);
            text.push('\n');
        }
        atomic_write(&path, |w| w.write_all(text.as_bytes()))?;
        let file = File::options().append(true).open(&path)?;
        Ok(Metrics(BufWriter::new(file)))
    }

    /// All losses logged so far.
    pub fn read_metrics(&self) -> anyhow::Result<Vec<Losses>> {
        read_metrics(&self.file("metrics.jsonl"))
    }
}

/// Whole lines of a metrics file; a last line that was cut short is left out.
fn read_metrics(path: &Path) -> anyhow::Result<Vec<Losses>> {
    let Ok(file) = File::open(path) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for line in BufReader::new(file).lines() {
        match serde_json::from_str(&line?) {
            Ok(losses) => all.push(losses),
            Err(_) => break,
        }
    }
    Ok(all)
}

/// The metrics file, one JSON object a line.
#[derive(Debug)]
pub struct Metrics(BufWriter<File>);

impl Metrics {
    /// Appends a line.
    pub fn push(&mut self, losses: &Losses) -> anyhow::Result<()> {
        writeln!(self.0, "{}", serde_json::to_string(losses)?)?;
        self.0.flush()?;
        Ok(())
    }
}
