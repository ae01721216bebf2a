//! `train --residual-of`: the augmented model of a discovery as the engine that a net corrects.

use crate::{DataFrom, Usage};
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, Trajectory};
use augsim_physics::model::{ModelFile, Per};
use augsim_trainer::{Engine, Recipe, SystemEngine};
use std::collections::BTreeSet;
use std::path::Path;

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
        anyhow::bail!(
            "{}: holds no {MODEL}; give the folder that `augsim discover` wrote its result to (--out)",
            run.display()
        );
    }
    engine_of(&ModelFile::read(&path)?, &path.display().to_string(), data, recipe)
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
    let dataset = data.read(MissingCells::AsGap)?;
    let groups: BTreeSet<Option<&str>> = dataset.trajectories().iter().map(Trajectory::group).collect();
    // A net's engine is one for all trajectories: that of their group, if all are of one.
    let model = match groups.first() {
        Some(Some(group)) if groups.len() == 1 => model.clone().of_group(group),
        _ => model.clone(),
    };
    let step_s = step_s(&dataset, data)?;
    let engine = SystemEngine::new(&model, Some(step_s)).with_context(|| place.to_owned())?;
    let left_out = engine.left_out().iter();
    let mut notes: Vec<String> = left_out
        .map(|kind| {
            format!("{kind} is left out: it changes what is measured, or is random, which the net learns")
        })
        .collect();
    notes.extend(model.parameters().filter(|p| p.per != Per::All).map(|p| {
        format!("{} differs between trajectories: its nominal value {} is used for all", p.name, p.nominal)
    }));
    if let Some(tau) = engine.contact_s().filter(|tau| recipe == Recipe::HybridPlus && *tau > 0.5 * step_s) {
        notes.push(format!(
            "contacts of {tau:.4} s against steps of {step_s:.4} s: single steps bounce in an instant, so samples of \
             this recipe scatter too far at impacts; --recipe hybrid reads the roll-out, which follows contacts"
        ));
    }
    Ok((Engine::Model(engine), notes))
}

fn reads_physics(recipe: Recipe) -> Result<(), Usage> {
    if matches!(recipe, Recipe::Neural | Recipe::NeuralPlus) {
        let label = recipe.label();
        let text =
            format!("the recipe of {label} reads no physics; leave out --residual-of, or choose a hybrid");
        return Err(Usage(text));
    }
    Ok(())
}

/// Seconds between the samples of the first trajectory; whether all others have them is checked when they are loaded.
fn step_s(dataset: &Dataset, data: &DataFrom) -> anyhow::Result<f64> {
    let step = dataset.trajectories().iter().find(|t| t.len() > 1).map(|t| {
        let clock = t.time_s();
        let mean = (clock[clock.len() - 1] - clock[0]) / (clock.len() - 1) as f64;
        // Times are decimal numbers: to a picosecond the mean is what was meant.
        (mean * 1e12).round() / 1e12
    });
    step.with_context(|| format!("{data}: no trajectory has two samples; nets learn steps"))
}
