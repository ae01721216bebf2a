//! Reads training and test data in the form that the engine of a run needs.

use crate::run_dir::{Config, DataSource};
use crate::usage::{Inapplicable, Missing, UnknownName};
use crate::{DataFrom, Usage, equations, states};
use anyhow::Context;
use augsim_data::checks::{CheckedData, ExpectedData, Warning, check_data};
use augsim_data::push::resample;
use augsim_data::{DataError, Dataset, MissingCells};
use augsim_physics::ball::drop_distribution::{self, DropDistribution, check_rate};
use augsim_physics::push::laboratory::{self, PushDesign, SUPPORTS, SupportSheet};
use augsim_physics::push::{OBJECTS, Object};
use augsim_trainer::push::{Subsampling, pushes};
use augsim_trainer::{Engine, Sequences};

/// Sampling rate to which published recordings are resampled, Hz: the rate of their sensors.
pub const PUBLISHED_RATE_HZ: f64 = 250.0;

/// Builds the engine of the paper's bouncing-ball experiment: restitution 0.65, Bullet's damping, 60 Hz.
pub fn published_predictor() -> Engine {
    Engine::PybulletBall(drop_distribution::published_predictor())
}

/// Reads or generates the data set of a source, and checks that it has the engine's sampling step.
///
/// # Errors
/// The source cannot be read or generated, has another step, or was a table in memory, which cannot be read
/// again.
pub fn read(source: &DataSource, engine: &Engine) -> anyhow::Result<Dataset> {
    let generated = match source {
        DataSource::File(path) => return read_measured(&DataFrom::File(path.clone()), engine),
        DataSource::Table { name, .. } => {
            return Err(Usage::Missing(Missing::Table { name: name.clone() }).into());
        }
        DataSource::DropDistribution { trajectories, seed } => {
            DropDistribution::default().generate(*trajectories, *seed)?.0
        }
        DataSource::PushLaboratory { object, surface, pushes, seed } => {
            recipe(PushDesign::Mit, object, surface, *pushes)?.generate(*seed)?.data
        }
    };
    if let Some(step_s) = engine.step_s() {
        check_rate(&generated, step_s)?;
    }
    Ok(generated)
}

/// Reads measured trajectories, and checks that they have the engine's sampling step.
///
/// For an equation model these are its inputs and outputs, with any step. If an engine with a ball model
/// finds no states in the data, they are estimated from the positions. For pushes every stream may have its
/// own clock, with gaps.
///
/// # Errors
/// The data cannot be read, or have another step.
pub fn read_measured(from: &DataFrom, engine: &Engine) -> anyhow::Result<Dataset> {
    if let Some(system) = engine.equation_engine() {
        return Ok(equations::records::read(from.clone(), system.equations())?.data);
    }
    let Some(step_s) = engine.step_s() else { return Ok(from.read(MissingCells::AsGap)?) };
    if engine.model().is_some() {
        let data = from.read(MissingCells::AsGap)?;
        if !states::has_states(&data, engine)
            && let Some(made) = states::estimate_from_positions(&data, engine, from)?
        {
            return Ok(made);
        }
    }
    let data = from.read(MissingCells::Refuse)?;
    check_rate(&data, step_s).with_context(|| from.to_string())?;
    Ok(data)
}

/// Converts the engine's columns of a data set to training sequences.
///
/// Pushes are resampled to one clock and thinned. States of an equation model are smoothed estimates that use
/// all samples: they are for training, not for predictions.
///
/// # Errors
/// A column is missing, or a sample has a gap.
pub fn sequences(data: &Dataset, engine: &Engine) -> anyhow::Result<Sequences> {
    if let Some(system) = engine.equation_engine() {
        return equations::states::sequences(data, system);
    }
    if engine.step_s().is_some() {
        return Ok(Sequences::with_actions(data, &engine.columns(), &engine.action_columns())?);
    }
    let has_streams = data.columns().iter().any(|c| c.name().ends_with("_new"));
    let resampled = has_streams.then(|| resample(data, PUBLISHED_RATE_HZ)).transpose()?;
    Ok(pushes(resampled.as_ref().unwrap_or(data), Subsampling::default())?)
}

/// Checks that the engine is of no equation model, whose states are not measured.
///
/// Smoothed estimates of the states would use the samples to be predicted.
fn check_states_are_measured(engine: &Engine) -> Result<(), Usage> {
    match engine.equation_engine() {
        Some(_) => Err(Usage::Inapplicable(Inapplicable::StartOfEquations)),
        None => Ok(()),
    }
}

/// Reads or generates the engine's columns of a data source, for prediction and scoring.
///
/// # Errors
/// As [`read`] and [`sequences`], or the engine is an equation model.
pub fn load(source: &DataSource, engine: &Engine) -> anyhow::Result<Sequences> {
    check_states_are_measured(engine)?;
    sequences(&read(source, engine)?, engine)
}

/// Reads the engine's columns of measured trajectories, for prediction and scoring.
///
/// # Errors
/// As [`load`].
pub fn load_measured(from: &DataFrom, engine: &Engine) -> anyhow::Result<Sequences> {
    check_states_are_measured(engine)?;
    sequences(&read_measured(from, engine)?, engine)
}

/// Builds the settings from which the virtual laboratory generates a data set of pushes.
///
/// # Errors
/// An unknown object or surface.
pub fn recipe(
    protocol: PushDesign,
    object: &str,
    surface: &str,
    pushes: usize,
) -> Result<laboratory::PushRecipe, Usage> {
    let (known, sheet) = object_on_surface(object, surface)?;
    Ok(laboratory::PushRecipe::new(protocol, &known, sheet, pushes))
}

/// Looks up a pushed object and its support sheet by name.
///
/// # Errors
/// [`Usage`], with the known names.
pub fn object_on_surface(object: &str, surface: &str) -> Result<(Object, SupportSheet), Usage> {
    let known = Object::named(object)
        .ok_or_else(|| Usage::Unknown(UnknownName::Object { name: object.to_owned(), known: &OBJECTS }))?;
    let sheet = SupportSheet::named(surface).ok_or_else(|| {
        let known = SUPPORTS.iter().map(|sheet| sheet.name).collect();
        Usage::Unknown(UnknownName::Surface { name: surface.to_owned(), known })
    })?;
    Ok((known, sheet))
}

/// Reads the engine's columns of measured trajectories; also returns the sample times of each, s.
///
/// # Errors
/// As [`read_measured`] and [`sequences`].
pub fn load_timed(from: &DataFrom, engine: &Engine) -> anyhow::Result<(Sequences, Vec<Vec<f64>>)> {
    check_states_are_measured(engine)?;
    let data = read_measured(from, engine)?;
    let sequences = sequences(&data, engine)?;
    // For pushes the time is the last action, since thinning may have dropped samples.
    let times = match engine.step_s() {
        Some(_) => data.trajectories().iter().map(|t| t.time_s().to_vec()).collect(),
        None => sequences
            .items
            .iter()
            .map(|q| (0..q.time).filter_map(|t| q.action(t).last().copied()).collect())
            .collect(),
    };
    Ok((sequences, times))
}

/// Reads or generates the training trajectories of a run, with the warnings of the data checks.
///
/// Generated data are not checked.
///
/// # Errors
/// As [`read`] and [`check_measured`].
pub fn load_checked(config: &Config) -> anyhow::Result<(Sequences, Vec<Warning>)> {
    let engine = &config.settings.engine;
    let data = read(&config.data, engine)?;
    match config.data {
        DataSource::File(_) => check_measured(data, config),
        _ => Ok((sequences(&data, engine)?, Vec::new())),
    }
}

/// Checks measured trajectories, and returns them as training sequences with the warnings.
///
/// # Errors
/// The data fail a check, or lack columns that the engine needs.
pub fn check_measured(data: Dataset, config: &Config) -> anyhow::Result<(Sequences, Vec<Warning>)> {
    let engine = &config.settings.engine;
    // A net without physics may be trained on any system, so no gravity is expected.
    let expected =
        if config.settings.recipe.is_without_physics() { ExpectedData::default() } else { engine.expected() };
    let accepted = config.accept.iter().copied().collect();
    let CheckedData { data, warnings } = check_data(data, &expected, accepted).map_err(DataError::from)?;
    Ok((sequences(&data, engine)?, warnings))
}
