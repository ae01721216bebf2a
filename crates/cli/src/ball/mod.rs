//! The bouncing ball on the command line: data, the table of models, the report.

mod experiment;
mod plan;
mod report;
mod result;
mod rows;

pub use plan::{Experiment, NetPlan};
pub use rows::{Row, table};

use crate::run_dir::DataSource;
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, read_dataset};
use augsim_physics::ball::paper_law::{self, PaperLaw};
use augsim_trainer::{Engine, Sequences};

/// The engine of the paper's experiment: restitution 0.65, Bullet's damping, 60 Hz.
pub fn paper_engine() -> Engine {
    Engine::PybulletBall(paper_law::paper_engine())
}

/// The data set of a source; its samples must be the engine's steps apart.
pub fn read(source: &DataSource, engine: &Engine) -> anyhow::Result<Dataset> {
    let dataset = match source {
        DataSource::File(path) => read_dataset(path, MissingCells::Refuse)?,
        DataSource::PaperLaw { trajectories, seed } => PaperLaw::default().generate(*trajectories, *seed)?.0,
        DataSource::PushLaboratory { .. } => {
            anyhow::bail!("pushes of the virtual laboratory are no drops of a ball")
        }
    };
    if let Some(step_s) = engine.step_s() {
        let checked = paper_law::check_rate(&dataset, step_s);
        match dataset.path() {
            Some(path) => checked.with_context(|| path.display().to_string())?,
            None => checked?,
        }
    }
    Ok(dataset)
}

/// The engine's columns of a data set.
pub fn sequences(dataset: &Dataset) -> anyhow::Result<Sequences> {
    Ok(Sequences::new(dataset, &paper_engine().columns())?)
}

/// The engine's columns of a source.
pub fn load(source: &DataSource, engine: &Engine) -> anyhow::Result<Sequences> {
    sequences(&read(source, engine)?)
}
