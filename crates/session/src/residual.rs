//! `train --residual-of` and `train --model`: the model that a net corrects, as an engine.

use crate::usage::Inapplicable;
use crate::{DataFrom, Usage, states, written};
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, Trajectory};
use augsim_physics::model::{ModelFile, Per};
use augsim_trainer::{Engine, Recipe, Room, ThrowEngine};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A folder that is to be of a discovery and holds no model.
#[derive(Debug, Error)]
#[error("{}: holds no {MODEL}; give the folder that `augsim discover` wrote its result to (--out)", folder.display())]
pub struct NoModel {
    folder: PathBuf,
}

/// The model file in the folder of a discovery.
pub const MODEL: &str = "model.toml";

/// The engine of the model in the discovery's folder `run`, with the step of the data, and notes for people about what of
/// the model takes no part.
///
/// # Errors
/// The recipe reads no physics, the folder holds no model, or the model is no engine of the data.
pub fn engine(run: &Path, data: &DataFrom, recipe: Recipe) -> anyhow::Result<(Engine, Vec<String>)> {
    reads_physics(recipe)?;
    let path = run.join(MODEL);
    if !path.is_file() {
        return Err(NoModel { folder: run.to_owned() }.into());
    }
    if written::is_model(&path) {
        return equations(&path, data);
    }
    engine_of(&ModelFile::read(&path)?, &path.display().to_string(), data, recipe)
}

/// The engine of a model file, which a net of any recipe may be trained beside: one that reads no physics has its states and
/// its step from it.
///
/// # Errors
/// The model is no engine of the data.
pub fn engine_of_file(path: &Path, data: &DataFrom, recipe: Recipe) -> anyhow::Result<(Engine, Vec<String>)> {
    if written::is_model(path) {
        return equations(path, data);
    }
    stepped(&ModelFile::read(path)?, &path.display().to_string(), data, recipe)
}

/// The engine of a system of equations, with steps and noise that suit the data.
fn equations(path: &Path, data: &DataFrom) -> anyhow::Result<(Engine, Vec<String>)> {
    let model = written::read(path)?;
    let measured = written::records::read(data.clone(), &model)?;
    let records = written::records::records(&measured.data, &model, true)?;
    let engine = written::states::engine(&model, &records).with_context(|| data.to_string())?;
    Ok((engine, written::states::notes(&model)))
}

/// The engine of a model, which is called `place` in messages, with the step of the data, and notes as [`engine`] gives them.
///
/// # Errors
/// As [`engine`].
pub fn engine_of(
    model: &ModelFile,
    place: &str,
    data: &DataFrom,
    recipe: Recipe,
) -> anyhow::Result<(Engine, Vec<String>)> {
    reads_physics(recipe)?;
    stepped(model, place, data, recipe)
}

/// The engine of a model with the step of the data, and notes for people about what of the model takes no part and about what
/// of the data is not as the net reads it.
fn stepped(
    model: &ModelFile,
    place: &str,
    data: &DataFrom,
    recipe: Recipe,
) -> anyhow::Result<(Engine, Vec<String>)> {
    let dataset = data.read(MissingCells::AsGap)?;
    let groups: BTreeSet<Option<&str>> = dataset.trajectories().iter().map(Trajectory::group).collect();
    // A net's engine is one for all trajectories: that of their group, if all are of one.
    let model = match groups.first() {
        Some(Some(group)) if groups.len() == 1 => model.clone().of_group(group),
        _ => model.clone(),
    };
    let step_s = step_s(&dataset, data)?;
    let engine = match &model {
        ModelFile::Ball(ball) => match room(&dataset) {
            Some(room) => ThrowEngine::new(ball, room, step_s).map(Engine::Throw),
            None => Engine::of(&model, Some(step_s)),
        },
        ModelFile::Push(_) => Engine::of(&model, None),
    };
    let engine = engine.with_context(|| place.to_owned())?;
    let left_out = engine.left_out().iter();
    let mut notes: Vec<String> = left_out
        .map(|kind| {
            format!("{kind} is left out: it changes what is measured, or is random, which the net learns")
        })
        .collect();
    notes.extend(model.parameters().filter(|p| p.per != Per::All).map(|p| {
        format!("{} differs between trajectories: its nominal value {} is used for all", p.name, p.nominal)
    }));
    if engine.step_s().is_some() && !states::are_there(&dataset, &engine) {
        notes.push(format!(
            "the net reads {} every {step_s} s, made of the positions: polynomials over the flights between impacts, \
             the first one from the part before the first impact",
            engine.columns().join(", ")
        ));
    }
    // A clock that is not that of the pushes' own streams is the only one that contacts can be long against.
    let long = engine.contact_s().filter(|tau| recipe == Recipe::HybridPlus && *tau > 0.5 * step_s);
    if let Some(tau) = long {
        notes.push(format!(
            "contacts of {tau:.4} s against steps of {step_s:.4} s: single steps bounce in an instant, so samples of \
             this recipe scatter too far at impacts; --recipe hybrid reads the roll-out, which follows contacts"
        ));
    }
    Ok((engine, notes))
}

fn reads_physics(recipe: Recipe) -> Result<(), Usage> {
    if recipe.is_blind() {
        return Err(Usage::Inapplicable(Inapplicable::PhysicsOfBlind { recipe: recipe.label() }));
    }
    Ok(())
}

/// In which coordinates a ball was measured: none where its height is alone.
fn room(data: &Dataset) -> Option<Room> {
    match ["x_m", "y_m", "z_m"].map(|column| data.has_column(column)) {
        [true, true, true] => Some(Room::Space),
        [true, false, true] => Some(Room::Plane),
        _ => None,
    }
}

/// Seconds between the samples of the first trajectory; of one whose clock is not regular, the median of all steps.
fn step_s(dataset: &Dataset, data: &DataFrom) -> anyhow::Result<f64> {
    let step = dataset.trajectories().iter().find(|t| t.len() > 1).map(|t| {
        let clock = t.time_s();
        let mean = (clock[clock.len() - 1] - clock[0]) / (clock.len() - 1) as f64;
        let regular =
            (clock.iter().enumerate()).all(|(k, s)| (s - clock[0] - k as f64 * mean).abs() < 0.1 * mean);
        let step = if regular { mean } else { median_step(dataset) };
        // Times are decimal numbers: to a picosecond the mean is what was meant.
        (step * 1e12).round() / 1e12
    });
    step.with_context(|| format!("{data}: no trajectory has two samples; nets learn steps"))
}

/// Median of all steps from sample to sample, s.
fn median_step(dataset: &Dataset) -> f64 {
    let steps = dataset.trajectories().iter().flat_map(|t| t.time_s().windows(2).map(|w| w[1] - w[0]));
    let mut steps: Vec<f64> = steps.collect();
    steps.sort_by(f64::total_cmp);
    steps[steps.len() / 2]
}
