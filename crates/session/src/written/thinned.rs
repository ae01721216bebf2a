//! Data that are sampled far more finely than the motion asks for.

use super::records::records;
use anyhow::Context;
use augsim_data::{Dataset, Trajectory};
use augsim_physics::system::Record;
use augsim_written::{Model, WrittenSystem};

/// Most samples of which one is kept.
const MOST: usize = 8;

/// Data of which every so many samples are kept, because these tell as much as all.
#[derive(Debug)]
pub struct Thinned {
    /// Every `every`th row: outputs as they were measured, inputs averaged.
    pub data: Dataset,
    /// Of how many samples one is kept.
    pub every: usize,
}

impl Thinned {
    /// The sentence for a result.
    pub fn sentence(&self) -> String {
        format!(
            "every {}th sample was fitted to, with inputs averaged: the outputs are smooth enough that these tell as much as all",
            self.every
        )
    }
}

/// The data with as few samples as tell as much as all; nothing where all are needed, or where there are gaps. `seen` are the
/// records of the data prepared by the system, whose parameters and steps suit them.
///
/// # Errors
/// The data have no such columns.
pub fn thinned(
    model: &Model,
    system: &WrittenSystem,
    data: &Dataset,
    seen: &[Record],
) -> anyhow::Result<Option<Thinned>> {
    let is_both = |name: &str| model.outputs.iter().any(|o| o.name == name);
    let is_complete = |t: &Trajectory| t.values().iter().flatten().all(|v| v.is_finite());
    if model.inputs.iter().any(|i| is_both(&i.name)) || !data.trajectories().iter().all(is_complete) {
        return Ok(None);
    }
    let told = std::iter::successors(Some(2), |every| Some(2 * every)).take_while(|every| *every <= MOST);
    let Some(every) = told.take_while(|every| system.is_told_by(*every, seen)).last() else {
        return Ok(None);
    };
    let mut trajectories = Vec::new();
    for (trajectory, record) in data.trajectories().iter().zip(records(data, model, false)?) {
        let picked = |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(every).collect() };
        let mut values: Vec<Vec<f64>> = trajectory.values().iter().map(|column| picked(column)).collect();
        for (input, averaged) in model.inputs.iter().zip(system.thinned_inputs(&record, every)) {
            values[data.column_index(&input.name)?] = averaged;
        }
        trajectories.push(trajectory.with_samples(picked(trajectory.time_s()), values)?);
    }
    let data = data.with_trajectories(trajectories).context("data with fewer samples")?;
    Ok(Some(Thinned { data, every }))
}
