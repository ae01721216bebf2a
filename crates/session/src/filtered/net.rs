//! A trained net behind a prefix.

use super::{Timed, View};
use crate::run_dir::RunDir;
use crate::{DataFrom, run_data};
use anyhow::Context;
use augsim_trainer::NetModel;
use augsim_trainer::filter::{Sensor, StartLaw};

/// A trained net with what it is shown.
#[derive(Debug)]
pub struct OfNet {
    /// The net.
    pub model: NetModel,
    /// The trajectories.
    pub data: Timed,
    /// The sensor.
    pub sensor: Sensor,
    /// The law of first states.
    pub start: StartLaw,
}

/// The net of a run directory for measured trajectories.
///
/// # Errors
/// The run or the data cannot be read; the training data, whose first states say what is not seen of a start, are gone.
pub fn of_net(run: &RunDir, from: &DataFrom, view: &View) -> anyhow::Result<OfNet> {
    let model = NetModel::new(run.read_model()?)?;
    let engine = &model.state().settings.engine;
    let (set, times) = run_data::load_timed(from, engine)?;
    let sensor = view.sensor(&set.columns)?;
    let start = if sensor.is_exact() {
        // The first row says all.
        StartLaw::of(&set.first_row())
    } else {
        let train = run_data::load(&run.read_config()?.data, engine).context(
            "what is not seen of a first state is known from the training data; put them back, or see every column exactly",
        )?;
        StartLaw::of(&train)
    };
    Ok(OfNet { model, data: Timed { set, times }, sensor, start })
}
