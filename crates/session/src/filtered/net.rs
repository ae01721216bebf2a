//! Filtered forecasts by a trained net.

use super::{ObservedColumns, TimedSequences};
use crate::run_dir::RunDir;
use crate::{DataFrom, run_data};
use anyhow::Context;
use augsim_trainer::NetModel;
use augsim_trainer::filter::{InitialStatePrior, Sensor};

/// A trained net, with the data and the sensor model of a filtered forecast.
#[derive(Debug)]
pub struct NetOnPrefix {
    /// The trained net that forecasts.
    pub model: NetModel,
    /// The measured trajectories to be observed and forecast.
    pub data: TimedSequences,
    /// Observed columns and their measurement noise.
    pub sensor: Sensor,
    /// Prior distribution of the initial state.
    pub start: InitialStatePrior,
}

/// Prepares the net of a run directory for filtered forecasts of measured trajectories.
///
/// # Errors
/// The run or the data cannot be read, or the training data, from which the prior of unobserved initial
/// states is estimated, are gone.
pub fn net_on_prefix(run: &RunDir, from: &DataFrom, view: &ObservedColumns) -> anyhow::Result<NetOnPrefix> {
    let model = NetModel::new(run.read_model()?)?;
    let engine = &model.state().settings.engine;
    let (set, times) = run_data::load_timed(from, engine)?;
    let sensor = view.sensor(&set.columns)?;
    let start = if sensor.is_exact() {
        // The first row is the exact initial state.
        InitialStatePrior::from_training_set(&set.first_row())
    } else {
        let train = run_data::load(&run.read_config()?.data, engine).context(
            "the prior of unobserved initial states is estimated from the training data, which cannot be read; restore them, or \
             observe every column exactly (leave out --seen-columns and --sensor-sd)",
        )?;
        InitialStatePrior::from_training_set(&train)
    };
    Ok(NetOnPrefix { model, data: TimedSequences { set, times }, sensor, start })
}
