//! The configuration of a training run on measured data.

use crate::provenance::fingerprint_of_bytes;
use crate::residual;
use crate::run_data::paper_engine;
use crate::run_dir::{Config, DataSource};
use crate::{DataFrom, Usage};
use augsim_data::checks::Check;
use augsim_physics::model::ModelFile;
use augsim_trainer::{Recipe, Settings};
use std::path::PathBuf;

/// Iterations between checkpoints, where nobody says otherwise.
pub const CHECKPOINT_EVERY: u64 = 500;

/// The model that a net corrects.
#[derive(Debug, Clone, PartialEq)]
pub enum Corrected {
    /// The augmented model in the folder of a discovery.
    Folder(PathBuf),
    /// This model.
    Model(Box<ModelFile>),
}

/// What a user wants of a training run.
#[derive(Debug, Clone, PartialEq)]
pub struct WantedRun {
    /// Net.
    pub recipe: Recipe,
    /// The model that the net corrects; the paper's ball where there is none.
    pub residual_of: Option<Corrected>,
    /// Iterations, at least 1.
    pub iterations: u64,
    /// Seed of every draw.
    pub seed: u64,
    /// Checks of suspicious data that are not made.
    pub accept: Vec<Check>,
}

/// The configuration for these data, and notes for people about what of the model takes no part.
///
/// # Errors
/// The recipe reads no physics, or the discovery's model is no engine of the data.
pub fn configure(wanted: &WantedRun, data: &DataFrom) -> anyhow::Result<(Config, Vec<String>)> {
    if wanted.iterations == 0 {
        return Err(Usage("iterations = 0: must be at least 1".to_owned()).into());
    }
    let (engine, notes) = match &wanted.residual_of {
        Some(Corrected::Folder(found)) => residual::engine(found, data, wanted.recipe)?,
        Some(Corrected::Model(model)) => residual::engine_of(model, "the model", data, wanted.recipe)?,
        None => (paper_engine(), Vec::new()),
    };
    let source = match data {
        DataFrom::File(path) => DataSource::File(path.clone()),
        DataFrom::Table { name, csv } => {
            DataSource::Table { name: name.clone(), content: fingerprint_of_bytes(csv) }
        }
    };
    let settings = Settings::new(wanted.recipe, wanted.iterations, wanted.seed, engine);
    let config =
        Config { checkpoint_every: CHECKPOINT_EVERY, accept: wanted.accept.clone(), data: source, settings };
    Ok((config, notes))
}
