//! Data as the engine of a run needs them.

use crate::experiment::data::{read, sequences};
use crate::run_dir::{Config, DataSource};
use augsim_data::DataError;
use augsim_data::checks::{Admitted, Expected, Warning, admit};
use augsim_trainer::{Engine, Recipe, Sequences};

/// Trajectories of a source with the times of the samples of each, s.
pub fn load_timed(source: &DataSource, engine: &Engine) -> anyhow::Result<(Sequences, Vec<Vec<f64>>)> {
    let data = read(source, engine)?;
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

/// Trajectories to train on: those of a file after every check of suspicious data, with what these warn of.
pub fn admitted(config: &Config) -> anyhow::Result<(Sequences, Vec<Warning>)> {
    let (source, engine) = (&config.data, &config.settings.engine);
    let data = read(source, engine)?;
    if !matches!(source, DataSource::File(_)) {
        return Ok((sequences(&data, engine)?, Vec::new()));
    }
    // A net without physics may learn any world: nothing is expected of its gravity.
    let expected = match config.settings.recipe {
        Recipe::Neural | Recipe::NeuralPlus => Expected::default(),
        _ => engine.expected(),
    };
    let accepted = config.accept.iter().copied().collect();
    let Admitted { data, warnings } = admit(data, &expected, accepted).map_err(DataError::from)?;
    Ok((sequences(&data, engine)?, warnings))
}
