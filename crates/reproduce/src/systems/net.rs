//! Trains Hybrid+ on the residual of the augmented model of a set, and scores it on the test record.

use super::sets::Set;
use augsim_discovery::PredictOptions;
use augsim_session::DataFrom;
use augsim_session::configure::{CHECKPOINT_EVERY, PhysicsSource};
use augsim_session::predict::net_scores;
use augsim_session::run_data;
use augsim_session::run_dir::{Config, DataSource};
use augsim_terminal::output::Output;
use augsim_terminal::training::train_or_resume;
use augsim_trainer::{Recipe, SAMPLES, Settings};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Default number of training iterations: on these records the loss does not decrease further.
pub const ITERATIONS: u64 = 2000;

/// Scores of a network on the test record of a benchmark set, in the unit of the table.
#[derive(Debug, Serialize)]
pub struct Net {
    /// Root mean square error of the mean of the samples; `None` if not finite.
    pub error: Option<f64>,
    /// Continuous ranked probability score of the samples; `None` if not finite.
    pub crps: Option<f64>,
    /// Coverage of the 50 % band as a fraction; the next field is that of the 90 % band.
    pub coverage50: f64,
    pub coverage90: f64,
    /// Shrinkage factor of the network's corrections, chosen on held-out segments of the training record.
    pub gain: f64,
    /// Path of the run directory, relative to the results folder.
    pub run: PathBuf,
}

/// Training iterations and seed of the network.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    pub iterations: u64,
    pub seed: u64,
    pub resume: bool,
}

/// Trains and scores the network; `found` is the folder of the discovery. Returns `None` if interrupted.
pub fn net(set: &Set, found: &Path, test: &Path, plan: Plan, output: &Output) -> anyhow::Result<Option<Net>> {
    let train = found.join("train.csv.gz");
    let corrected = PhysicsSource::Folder(found.to_owned());
    let recipe = Recipe::HybridPlus;
    let (engine, _) = corrected.engine(&DataFrom::from(&train), recipe)?;
    let config = Config {
        checkpoint_every: CHECKPOINT_EVERY,
        accept: Vec::new(),
        residual_of: corrected.residual_of(),
        data: DataSource::File(train),
        settings: Settings::new(recipe, plan.iterations, plan.seed, engine),
    };
    let (records, warnings) = run_data::load_checked(&config)?;
    output.warn(&warnings);
    let Some(trained) = train_or_resume(&found.join("net"), &config, &records, plan.resume, output)? else {
        return Ok(None);
    };
    let options = PredictOptions { seed: plan.seed, draws: SAMPLES, only: None };
    let scores = net_scores(&trained.model, &DataFrom::from(test), set.burn_in, &options)?;
    let scaled = |v: f64| Some(set.unit.1 * v).filter(|v| v.is_finite());
    let row = scores.first();
    Ok(Some(Net {
        error: row.and_then(|r| scaled(r.row.rmse)),
        crps: row.and_then(|r| scaled(r.crps)),
        coverage50: row.map_or(0.0, |r| r.coverage50),
        coverage90: row.map_or(0.0, |r| r.coverage90),
        gain: trained.model.shrinkage().map_or(1.0, |trust| trust.gain),
        run: Path::new(set.name).join("net"),
    }))
}
