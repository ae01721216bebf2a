//! What an experiment with balls is asked to do.

use crate::run_dir::DataSource;
use augsim_trainer::Recipe;

/// One net to train.
#[derive(Debug, Clone, Copy)]
pub struct NetPlan {
    /// Which.
    pub recipe: Recipe,
    /// Iterations.
    pub iterations: u64,
}

/// What is run.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Title of the report.
    pub title: String,
    /// Command that repeats it.
    pub command: String,
    /// Training data.
    pub train: DataSource,
    /// Test data, of the paper's law: never trained on.
    pub test: DataSource,
    /// Name of the test set in the table.
    pub test_name: String,
    /// Nets, in the order of the table.
    pub nets: Vec<NetPlan>,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}
