//! Data as the engine of a run needs them.

use crate::run_dir::{Config, DataSource};
use crate::usage::{Inapplicable, Missing, UnknownName};
use crate::{DataFrom, Usage, states, written};
use anyhow::Context;
use augsim_data::checks::{Admitted, Expected, Warning, admit};
use augsim_data::push::resample;
use augsim_data::{DataError, Dataset, MissingCells};
use augsim_physics::ball::paper_law::{self, PaperLaw, check_rate};
use augsim_physics::push::laboratory::{self, Protocol, SUPPORTS, SupportSheet};
use augsim_physics::push::{OBJECTS, Object};
use augsim_trainer::push::{Thinning, pushes};
use augsim_trainer::{Engine, Sequences};

/// Rate at which published recordings are brought onto one clock, Hz: that of their sensors.
pub const PUBLISHED_RATE_HZ: f64 = 250.0;

/// The engine of the paper's experiment with drops: restitution 0.65, Bullet's damping, 60 Hz.
pub fn paper_engine() -> Engine {
    Engine::PybulletBall(paper_law::paper_engine())
}

/// The data set of a source, checked to have the engine's step.
///
/// # Errors
/// It cannot be read or made, its step is another, or it was a table in memory, which no file can bring back.
pub fn read(source: &DataSource, engine: &Engine) -> anyhow::Result<Dataset> {
    let made = match source {
        DataSource::File(path) => return read_measured(&DataFrom::File(path.clone()), engine),
        DataSource::Table { name, .. } => {
            return Err(Usage::Missing(Missing::Table { name: name.clone() }).into());
        }
        DataSource::PaperLaw { trajectories, seed } => PaperLaw::default().generate(*trajectories, *seed)?.0,
        DataSource::PushLaboratory { object, surface, pushes, seed } => {
            recipe(Protocol::Mit, object, surface, *pushes)?.generate(*seed)?.data
        }
    };
    if let Some(step_s) = engine.step_s() {
        check_rate(&made, step_s)?;
    }
    Ok(made)
}

/// Measured trajectories, checked to have the engine's step, of a system of equations its inputs and outputs; where an engine with a model finds no such states, they are made of
/// the positions. Where the actions have a clock, streams may have each its own,
/// with gaps between.
///
/// # Errors
/// They cannot be read, or their step is another.
pub fn read_measured(from: &DataFrom, engine: &Engine) -> anyhow::Result<Dataset> {
    if let Some(system) = engine.written() {
        return Ok(written::records::read(from.clone(), system.equations())?.data);
    }
    let Some(step_s) = engine.step_s() else { return Ok(from.read(MissingCells::AsGap)?) };
    if engine.model().is_some() {
        let data = from.read(MissingCells::AsGap)?;
        if !states::are_there(&data, engine)
            && let Some(made) = states::made_of_positions(&data, engine, from)?
        {
            return Ok(made);
        }
    }
    let data = from.read(MissingCells::Refuse)?;
    check_rate(&data, step_s).with_context(|| from.to_string())?;
    Ok(data)
}

/// The engine's columns of a data set: at its step, or on one clock and thinned; states of a system of equations are estimated from all
/// samples, to learn from and for no forecast.
///
/// # Errors
/// A column is missing, or a sample has a gap.
pub fn sequences(data: &Dataset, engine: &Engine) -> anyhow::Result<Sequences> {
    if let Some(system) = engine.written() {
        return written::states::sequences(data, system);
    }
    if engine.step_s().is_some() {
        return Ok(Sequences::with_actions(data, &engine.columns(), &engine.action_columns())?);
    }
    let streams = data.columns().iter().any(|c| c.name().ends_with("_new"));
    let resampled = streams.then(|| resample(data, PUBLISHED_RATE_HZ)).transpose()?;
    Ok(pushes(resampled.as_ref().unwrap_or(data), Thinning::default())?)
}

/// Refuses systems of equations, whose states no data have: those that are estimated have seen what is to be forecast.
fn starts_are_measured(engine: &Engine) -> Result<(), Usage> {
    match engine.written() {
        Some(_) => Err(Usage::Inapplicable(Inapplicable::StartOfEquations)),
        None => Ok(()),
    }
}

/// The engine's columns of a source, to forecast and to score.
///
/// # Errors
/// As [`read`] and [`sequences`]; a system of equations.
pub fn load(source: &DataSource, engine: &Engine) -> anyhow::Result<Sequences> {
    starts_are_measured(engine)?;
    sequences(&read(source, engine)?, engine)
}

/// The recipe of a set of the laboratory.
///
/// # Errors
/// There is no such object or support.
pub fn recipe(
    protocol: Protocol,
    object: &str,
    surface: &str,
    pushes: usize,
) -> Result<laboratory::Recipe, Usage> {
    let (known, sheet) = object_on_surface(object, surface)?;
    Ok(laboratory::Recipe::new(protocol, &known, sheet, pushes))
}

/// A pushed object and the sheet that it lies on, by their names.
///
/// # Errors
/// [`Usage`], with the names that there are.
pub fn object_on_surface(object: &str, surface: &str) -> Result<(Object, SupportSheet), Usage> {
    let known = Object::named(object)
        .ok_or_else(|| Usage::Unknown(UnknownName::Object { name: object.to_owned(), known: &OBJECTS }))?;
    let sheet = SupportSheet::named(surface).ok_or_else(|| {
        let known = SUPPORTS.iter().map(|sheet| sheet.name).collect();
        Usage::Unknown(UnknownName::Surface { name: surface.to_owned(), known })
    })?;
    Ok((known, sheet))
}

/// The engine's columns of measured trajectories, with the times of the samples of each, s.
///
/// # Errors
/// As [`read_measured`] and [`sequences`].
pub fn load_timed(from: &DataFrom, engine: &Engine) -> anyhow::Result<(Sequences, Vec<Vec<f64>>)> {
    starts_are_measured(engine)?;
    let data = read_measured(from, engine)?;
    let all = sequences(&data, engine)?;
    // Where the actions have a clock, it is the last of them, and samples may have been left out.
    let times = match engine.step_s() {
        Some(_) => data.trajectories().iter().map(|t| t.time_s().to_vec()).collect(),
        None => all
            .items
            .iter()
            .map(|q| (0..q.time).filter_map(|t| q.action(t).last().copied()).collect())
            .collect(),
    };
    Ok((all, times))
}

/// Trajectories of a run to train on: those of a file after every check of suspicious data, with what these warn of.
///
/// # Errors
/// As [`read`] and [`admit_measured`].
pub fn admitted(config: &Config) -> anyhow::Result<(Sequences, Vec<Warning>)> {
    let engine = &config.settings.engine;
    let data = read(&config.data, engine)?;
    match config.data {
        DataSource::File(_) => admit_measured(data, config),
        _ => Ok((sequences(&data, engine)?, Vec::new())),
    }
}

/// Measured trajectories to train on as a run is configured, after every check of suspicious data, with what these warn of.
///
/// # Errors
/// Data that cannot be right, or lack columns that the engine needs.
pub fn admit_measured(data: Dataset, config: &Config) -> anyhow::Result<(Sequences, Vec<Warning>)> {
    let engine = &config.settings.engine;
    // A net without physics may learn any world: nothing is expected of its gravity.
    let expected = if config.settings.recipe.is_blind() { Expected::default() } else { engine.expected() };
    let accepted = config.accept.iter().copied().collect();
    let Admitted { data, warnings } = admit(data, &expected, accepted).map_err(DataError::from)?;
    Ok((sequences(&data, engine)?, warnings))
}
