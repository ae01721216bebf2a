//! Data as the engine of a run needs them: its columns at its step, or pushes on one clock.

use crate::run_dir::{Config, DataSource};
use crate::{ball, push};
use augsim_data::DataError;
use augsim_data::checks::{Admitted, Expected, Warning, admit};
use augsim_trainer::{Engine, Recipe, Sequences};

/// Trajectories for scoring a run with that engine.
pub fn load(source: &DataSource, engine: &Engine) -> anyhow::Result<Sequences> {
    Ok(load_timed(source, engine)?.0)
}

/// The same with the times of the samples of each, s.
pub fn load_timed(source: &DataSource, engine: &Engine) -> anyhow::Result<(Sequences, Vec<Vec<f64>>)> {
    match engine.step_s() {
        None => {
            let pushes = push::load(source)?;
            let clock = |q: &augsim_trainer::Sequence| (0..q.time).map(|t| q.action(t)[2]).collect();
            let times = pushes.items.iter().map(clock).collect();
            Ok((pushes, times))
        }
        Some(_) => {
            let data = ball::read(source, engine)?;
            let times = data.trajectories().iter().map(|t| t.time_s().to_vec()).collect();
            Ok((ball::sequences(&data)?, times))
        }
    }
}

/// Trajectories to train on: those of a file after every check of suspicious data, with what these warn of.
pub fn admitted(config: &Config) -> anyhow::Result<(Sequences, Vec<Warning>)> {
    let (source, engine) = (&config.data, &config.settings.engine);
    let DataSource::File(path) = source else { return Ok((load(source, engine)?, Vec::new())) };
    // A net without physics may learn any world: nothing is expected of its gravity.
    let expected = match config.settings.recipe {
        Recipe::Neural | Recipe::NeuralPlus => Expected::default(),
        _ => engine.expected(),
    };
    let check =
        |data| admit(data, &expected, config.accept.iter().copied().collect()).map_err(DataError::from);
    match engine.step_s() {
        None => {
            let Admitted { data, warnings } = check(push::read_file(path)?)?;
            Ok((push::on_one_clock(&data)?, warnings))
        }
        Some(_) => {
            let Admitted { data, warnings } = check(ball::read(source, engine)?)?;
            Ok((ball::sequences(&data)?, warnings))
        }
    }
}
