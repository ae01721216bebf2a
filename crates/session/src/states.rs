//! States that nets read, made of positions alone, on any clock.

use crate::DataFrom;
use anyhow::Context;
use augsim_data::{Dataset, Trajectory};
use augsim_discovery::on_a_clock;
use augsim_physics::ball::paper_law::check_rate;
use augsim_physics::model::ModelFile;
use augsim_trainer::Engine;

/// Whether data have the engine's columns, without gaps, at the engine's step.
pub fn are_there(data: &Dataset, engine: &Engine) -> bool {
    let Some(step_s) = engine.step_s() else { return true };
    let places: Option<Vec<usize>> = engine.columns().iter().map(|c| data.column_index(c).ok()).collect();
    let Some(places) = places else { return false };
    let whole = |t: &Trajectory| places.iter().all(|&i| t.column(i).iter().all(|v| v.is_finite()));
    data.trajectories().iter().all(whole) && check_rate(data, step_s).is_ok()
}

/// The engine's columns at the engine's step, from the positions of trajectories; none where the engine has no model by which
/// impacts would be found.
///
/// # Errors
/// Model and data do not go together, or no trajectory can be used.
pub fn made_of_positions(
    data: &Dataset,
    engine: &Engine,
    from: &DataFrom,
) -> anyhow::Result<Option<Dataset>> {
    let (Some(text), Some(step_s)) = (engine.model(), engine.step_s()) else { return Ok(None) };
    let ModelFile::Ball(model) = ModelFile::parse(text, "model of the run")? else { return Ok(None) };
    let mut rows = Vec::new();
    for r in on_a_clock(&model, data, step_s).with_context(|| from.to_string())? {
        let row = Trajectory::new(r.id, r.times, [r.values, r.rates].concat())?;
        rows.push(match r.group {
            Some(group) => row.with_group(group)?,
            None => row,
        });
    }
    let made = Dataset::from_names(&engine.columns(), rows)?;
    Ok(Some(made))
}
