//! The bouncing ball on the command line: data, the table of models, the report.

mod experiment;
mod report;
mod rows;

pub use experiment::{Experiment, NetPlan};
pub use rows::{Row, table};

use crate::run_dir::DataSource;
use augsim_data::{Dataset, MissingCells, read_dataset};
use augsim_physics::ball::paper_law::{self, PaperLaw};
use augsim_trainer::{Engine, EngineSpec, Sequences};

/// The engine of the paper's experiment: restitution 0.65, Bullet's damping, 60 Hz.
pub fn paper_engine() -> EngineSpec {
    EngineSpec::PybulletBall(paper_law::paper_engine())
}

/// The data set of a source, at the engine's rate.
pub fn read(source: &DataSource) -> anyhow::Result<Dataset> {
    let dataset = match source {
        DataSource::File(path) => read_dataset(path, MissingCells::Refuse)?,
        DataSource::PaperLaw { trajectories, seed } => PaperLaw::default().generate(*trajectories, *seed)?.0,
        DataSource::PushLaboratory { .. } => {
            anyhow::bail!("the run was trained on pushes; its forecasts are in `reproduce push`")
        }
    };
    paper_law::check_rate(&dataset, paper_law::paper_engine().step_s)?;
    Ok(dataset)
}

/// The engine's columns of a data set.
pub fn sequences(dataset: &Dataset) -> anyhow::Result<Sequences> {
    Ok(Sequences::new(dataset, paper_engine().columns())?)
}

/// The engine's columns of a source.
pub fn load(source: &DataSource) -> anyhow::Result<Sequences> {
    sequences(&read(source)?)
}
