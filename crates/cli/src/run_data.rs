//! Data as the engine of a run needs them: its columns at its step, or pushes on one clock.

use crate::run_dir::DataSource;
use crate::{ball, push};
use augsim_trainer::{EngineSpec, Sequences};

/// Trajectories for training or scoring a run with that engine.
pub fn load(source: &DataSource, engine: &EngineSpec) -> anyhow::Result<Sequences> {
    Ok(load_timed(source, engine)?.0)
}

/// The same with the times of the samples of each, s.
pub fn load_timed(source: &DataSource, engine: &EngineSpec) -> anyhow::Result<(Sequences, Vec<Vec<f64>>)> {
    match engine {
        EngineSpec::Push(_) => {
            let pushes = push::load(source)?;
            let clock = |q: &augsim_trainer::Sequence| (0..q.time).map(|t| q.action(t)[2]).collect();
            let times = pushes.items.iter().map(clock).collect();
            Ok((pushes, times))
        }
        _ => {
            let data = ball::read(source, engine)?;
            let times = data.trajectories().iter().map(|t| t.time_s().to_vec()).collect();
            Ok((ball::sequences(&data)?, times))
        }
    }
}
