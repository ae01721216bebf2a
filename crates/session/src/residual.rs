//! `train --residual-of` and `train --model`: the physics engine of the model that a net corrects.

use crate::usage::Inapplicable;
use crate::{DataFrom, Usage, equations, states};
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, Trajectory};
use augsim_physics::model::ModelFile;
use augsim_system::Per;
use augsim_trainer::{Engine, Recipe, ThrowAxes, ThrowEngine};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Error: a folder given as the result of a discovery contains no model file.
#[derive(Debug, Error)]
#[error("{}: contains no {MODEL}; give the folder that `augsim discover` wrote (--out)", folder.display())]
pub struct NoModel {
    folder: PathBuf,
}

/// Name of the model file in the folder of a discovery.
pub const MODEL: &str = "model.toml";

/// Builds the physics engine of the model in the discovery folder `run`; also returns notes on unused model parts.
///
/// Its step is the sampling step of the data.
///
/// # Errors
/// The recipe uses no physics, the folder has no model, or the model does not fit the data.
pub fn engine(run: &Path, data: &DataFrom, recipe: Recipe) -> anyhow::Result<(Engine, Vec<String>)> {
    check_uses_physics(recipe)?;
    let path = run.join(MODEL);
    if !path.is_file() {
        return Err(NoModel { folder: run.to_owned() }.into());
    }
    if equations::is_model(&path) {
        return equations(&path, data);
    }
    engine_of_model(&ModelFile::read(&path)?, &path.display().to_string(), data, recipe)
}

/// Builds the physics engine of a model file, for a net of any recipe.
///
/// A net that uses no physics takes only its states and its step from the engine. Also returns notes on
/// unused model parts.
///
/// # Errors
/// The model does not fit the data.
pub fn engine_of_file(path: &Path, data: &DataFrom, recipe: Recipe) -> anyhow::Result<(Engine, Vec<String>)> {
    if equations::is_model(path) {
        return equations(path, data);
    }
    engine_with_data_step(&ModelFile::read(path)?, &path.display().to_string(), data, recipe)
}

/// Builds the engine of an equation model, with integration steps and measurement noise estimated from the data.
fn equations(path: &Path, data: &DataFrom) -> anyhow::Result<(Engine, Vec<String>)> {
    let model = equations::read(path)?;
    let measured = equations::records::read(data.clone(), &model)?;
    let records = equations::records::records(&measured.data, &model, true)?;
    let engine = equations::states::engine(&model, &records).with_context(|| data.to_string())?;
    Ok((engine, equations::states::notes(&model)))
}

/// Builds the physics engine of a model in memory, called `place` in messages; also returns notes as [`engine`] does.
///
/// # Errors
/// As [`engine`].
pub fn engine_of_model(
    model: &ModelFile,
    place: &str,
    data: &DataFrom,
    recipe: Recipe,
) -> anyhow::Result<(Engine, Vec<String>)> {
    check_uses_physics(recipe)?;
    engine_with_data_step(model, place, data, recipe)
}

/// Builds the engine of a built-in model with the sampling step of the data; also returns notes for the user.
fn engine_with_data_step(
    model: &ModelFile,
    place: &str,
    data: &DataFrom,
    recipe: Recipe,
) -> anyhow::Result<(Engine, Vec<String>)> {
    let dataset = data.read(MissingCells::AsGap)?;
    let groups: BTreeSet<Option<&str>> = dataset.trajectories().iter().map(Trajectory::group).collect();
    // One engine serves all trajectories, so group values can be used only if there is a single group.
    let model = match groups.first() {
        Some(Some(group)) if groups.len() == 1 => model.clone().of_group(group),
        _ => model.clone(),
    };
    let step_s = step_s(&dataset, data)?;
    let engine = match &model {
        ModelFile::Ball(ball) => match room(&dataset) {
            Some(room) => ThrowEngine::new(ball, room, step_s).map(Engine::Throw),
            None => Engine::from_model_file(&model, Some(step_s)),
        },
        ModelFile::Push(_) => Engine::from_model_file(&model, None),
    };
    let engine = engine.with_context(|| place.to_owned())?;
    let left_out = engine.ignored_effects().iter();
    let mut notes: Vec<String> = left_out
        .map(|kind| {
            format!("{kind} is left out of the physics: it changes the measurement or is random, and the net learns it")
        })
        .collect();
    notes.extend(model.parameters().filter(|p| p.per != Per::All).map(|p| {
        format!(
            "{} differs between trajectories, which a net does not support: its nominal value {} is used for all",
            p.name, p.nominal
        )
    }));
    if engine.step_s().is_some() && !states::has_states(&dataset, &engine) {
        notes.push(format!(
            "the net uses {} every {step_s} s, estimated from the positions by polynomials fitted to each flight between \
             impacts",
            engine.columns().join(", ")
        ));
    }
    // The engine of pushes has no contact duration, so this concerns balls only.
    let long = engine.contact_duration_s().filter(|tau| recipe == Recipe::HybridPlus && *tau > 0.5 * step_s);
    if let Some(tau) = long {
        notes.push(format!(
            "contacts last {tau:.4} s, long against the step of {step_s:.4} s; this recipe simulates single steps with instantaneous \
             impacts, so its samples scatter too much there; --recipe hybrid uses the full simulation, which resolves contacts"
        ));
    }
    Ok((engine, notes))
}

fn check_uses_physics(recipe: Recipe) -> Result<(), Usage> {
    if recipe.is_without_physics() {
        return Err(Usage::Inapplicable(Inapplicable::PhysicsOfPlainNet { recipe: recipe.label() }));
    }
    Ok(())
}

/// Axes in which a ball was measured: space (x, y, z) or plane (x, z); `None` if only its height was measured.
fn room(data: &Dataset) -> Option<ThrowAxes> {
    match ["x_m", "y_m", "z_m"].map(|column| data.has_column(column)) {
        [true, true, true] => Some(ThrowAxes::Space),
        [true, false, true] => Some(ThrowAxes::Plane),
        _ => None,
    }
}

/// Mean sampling step of the first trajectory, s; the median step of all trajectories if its clock is irregular.
fn step_s(dataset: &Dataset, data: &DataFrom) -> anyhow::Result<f64> {
    let step = dataset.trajectories().iter().find(|t| t.len() > 1).map(|t| {
        let clock = t.time_s();
        let mean = (clock[clock.len() - 1] - clock[0]) / (clock.len() - 1) as f64;
        let regular =
            (clock.iter().enumerate()).all(|(k, s)| (s - clock[0] - k as f64 * mean).abs() < 0.1 * mean);
        let step = if regular { mean } else { median_step(dataset) };
        // Times in files are rounded decimals; rounding the mean to a picosecond restores the intended step.
        (step * 1e12).round() / 1e12
    });
    step.with_context(|| {
        format!("{data}: no trajectory has two samples; a net is trained on steps from sample to sample")
    })
}

/// Median sampling step over all trajectories, s.
fn median_step(dataset: &Dataset) -> f64 {
    let steps = dataset.trajectories().iter().flat_map(|t| t.time_s().windows(2).map(|w| w[1] - w[0]));
    let mut steps: Vec<f64> = steps.collect();
    steps.sort_by(f64::total_cmp);
    steps[steps.len() / 2]
}
