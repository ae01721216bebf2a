//! Estimates the states that nets use from positions sampled at any times.

use crate::DataFrom;
use anyhow::Context;
use augsim_data::{Dataset, Trajectory};
use augsim_discovery::resample_uniformly;
use augsim_physics::ball::drop_distribution::check_rate;
use augsim_physics::model::ModelFile;
use augsim_trainer::Engine;

/// Whether the data have the engine's state columns, at the engine's sampling step and without gaps.
pub fn has_states(data: &Dataset, engine: &Engine) -> bool {
    let Some(step_s) = engine.step_s() else { return true };
    let indices: Option<Vec<usize>> = engine.columns().iter().map(|c| data.column_index(c).ok()).collect();
    let Some(indices) = indices else { return false };
    let is_complete = |t: &Trajectory| indices.iter().all(|&i| t.column(i).iter().all(|v| v.is_finite()));
    data.trajectories().iter().all(is_complete) && check_rate(data, step_s).is_ok()
}

/// Estimates the engine's state columns, at the engine's sampling step, from the positions of the trajectories.
///
/// `None` if the engine has no ball model, with which impacts are found.
///
/// # Errors
/// The data do not fit the model, or no trajectory can be used.
pub fn estimate_from_positions(
    data: &Dataset,
    engine: &Engine,
    from: &DataFrom,
) -> anyhow::Result<Option<Dataset>> {
    let (Some(text), Some(step_s)) = (engine.model(), engine.step_s()) else { return Ok(None) };
    let ModelFile::Ball(model) = ModelFile::parse(text, "model of the run")? else { return Ok(None) };
    let mut rows = Vec::new();
    for r in resample_uniformly(&model, data, step_s).with_context(|| from.to_string())? {
        let row = Trajectory::new(r.id, r.times, [r.values, r.rates].concat())?;
        rows.push(match r.group {
            Some(group) => row.with_group(group)?,
            None => row,
        });
    }
    Ok(Some(Dataset::from_names(&engine.columns(), rows)?))
}
