//! The configuration of a training run on measured data.

use crate::residual;
use crate::run_data::published_predictor;
use crate::run_dir::{Config, DataSource};
use crate::usage::{Missing, Takes};
use crate::{DataFrom, Usage};
use augsim_data::checks::Check;
use augsim_physics::model::ModelFile;
use augsim_trainer::{Engine, Recipe, Settings};
use std::path::{Path, PathBuf};

/// Default number of iterations between checkpoints.
pub const CHECKPOINT_EVERY: u64 = 500;

/// Where the physics model that a net corrects comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum PhysicsSource {
    /// The augmented model in the folder of a discovery.
    Folder(PathBuf),
    /// A model file that is already parsed, in memory.
    Model(Box<ModelFile>),
    /// Path of a model file.
    File(PathBuf),
    /// The bouncing-ball model of the paper's experiment.
    PybulletBall,
}

/// A user's request for a training run.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingRequest {
    /// Kind of net to train, with its loss.
    pub recipe: Recipe,
    /// The physics model that the net corrects; `None` means the paper's ball model.
    pub residual_of: Option<PhysicsSource>,
    /// Number of training iterations, at least 1.
    pub iterations: u64,
    /// Seed of all random draws of the training.
    pub seed: u64,
    /// Data checks that the user skips.
    pub accept: Vec<Check>,
}

impl PhysicsSource {
    /// Chooses the physics model from the options of a command, of which at most one is given.
    ///
    /// # Errors
    /// [`Usage::Missing`] if none is given: no model is assumed.
    pub fn from_options(
        residual_of: Option<&Path>,
        model: Option<&Path>,
        pybullet_ball: bool,
        data: &DataFrom,
    ) -> Result<Self, Usage> {
        match (residual_of, model) {
            (Some(folder), _) => Ok(PhysicsSource::Folder(folder.to_owned())),
            (None, Some(file)) => Ok(PhysicsSource::File(file.to_owned())),
            (None, None) if pybullet_ball => Ok(PhysicsSource::PybulletBall),
            (None, None) => Err(Usage::Missing(Missing::Model { data: data.to_string() })),
        }
    }

    /// Builds the physics engine of the model, and returns notes for the user.
    ///
    /// # Errors
    /// As [`residual::engine`], [`residual::engine_of_model`] and [`residual::engine_of_file`].
    pub fn engine(&self, data: &DataFrom, recipe: Recipe) -> anyhow::Result<(Engine, Vec<String>)> {
        match self {
            PhysicsSource::Folder(found) => residual::engine(found, data, recipe),
            PhysicsSource::Model(model) => residual::engine_of_model(model, "the model", data, recipe),
            PhysicsSource::File(file) => residual::engine_of_file(file, data, recipe),
            PhysicsSource::PybulletBall => Ok((published_predictor(), Vec::new())),
        }
    }

    /// Folder of the discovery that the model comes from; `None` for other sources.
    pub fn residual_of(&self) -> Option<PathBuf> {
        match self {
            PhysicsSource::Folder(folder) => Some(folder.clone()),
            _ => None,
        }
    }
}

/// Builds the configuration of a training run on these data.
///
/// Also returns notes for the user about parts of the model that are not used.
///
/// # Errors
/// No iterations, a recipe that uses no physics, or a model that does not fit the data.
pub fn configure(wanted: &TrainingRequest, data: &DataFrom) -> anyhow::Result<(Config, Vec<String>)> {
    if wanted.iterations == 0 {
        return Err(Usage::keyword("iterations", 0, Takes::AtLeastOne).into());
    }
    let (engine, notes) = match &wanted.residual_of {
        Some(corrected) => corrected.engine(data, wanted.recipe)?,
        None => (published_predictor(), Vec::new()),
    };
    let source = match data.ungrouped() {
        DataFrom::File(path) | DataFrom::FileWithTime { path, .. } => DataSource::File(path.clone()),
        // A training reads one file or folder, with which it can be resumed.
        DataFrom::Files { paths, .. } => DataSource::File(paths.first().cloned().unwrap_or_default()),
        other => DataSource::Table { name: other.to_string(), content: other.fingerprint() },
    };
    let settings = Settings::new(wanted.recipe, wanted.iterations, wanted.seed, engine);
    let config = Config {
        checkpoint_every: CHECKPOINT_EVERY,
        accept: wanted.accept.clone(),
        residual_of: wanted.residual_of.as_ref().and_then(PhysicsSource::residual_of),
        data: source,
        settings,
    };
    Ok((config, notes))
}
