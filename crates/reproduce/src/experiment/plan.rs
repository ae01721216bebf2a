//! Plan of an experiment: networks, data, tables.

use super::result::ResultFile;
use augsim_report::page::KeyFigure;
use augsim_trainer::Recipe;
use std::path::PathBuf;

/// A network to train: its recipe (model class) and number of iterations.
#[derive(Debug, Clone, Copy)]
pub struct NetPlan {
    /// Recipe (model class) of the network.
    pub recipe: Recipe,
    /// Number of training iterations of the network.
    pub iterations: u64,
}

/// Plan of an experiment: networks to train on one set and to score on test sets, beside the physics.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Command line that repeats the experiment.
    pub command: String,
    /// Name of the test set if it is the only one; then its generating distribution is known.
    ///
    /// The lower error bound and reconstructions are computed only in that case.
    pub floor: Option<String>,
    /// Whether models without training are scored too.
    pub baselines: bool,
    /// Networks to train, in the order of the table.
    pub nets: Vec<NetPlan>,
    /// Training-set sizes of the learning curve, for the networks Hybrid+ and Neural+; empty without a curve.
    pub sizes: Vec<usize>,
    /// Number of training steps of the Gaussian processes of pushing; `None` without them.
    pub gp_steps: Option<usize>,
    /// Number of repetitions of one push in the virtual laboratory; `None` without this comparison.
    pub repeats: Option<usize>,
    /// Folder of measured pusher-slider runs; `None` without them.
    pub runs: Option<PathBuf>,
    /// Whether this is the reduced version of the experiment (`--quick`).
    pub quick: bool,
    /// Titles, summaries and notes of the report.
    pub words: ExperimentTexts,
    /// Seed of generated data and of the training.
    pub seed: u64,
    /// Whether existing training runs are continued.
    pub resume: bool,
}

/// Titles, summaries and notes of the report of an experiment.
#[derive(Debug, Clone)]
pub struct ExperimentTexts {
    /// Name of the scenario: `ball` or `push`.
    pub scenario: &'static str,
    /// Kind of report, which a page shows above its title.
    pub kind: &'static str,
    /// Title of the report.
    pub title: String,
    /// Function that summarises the results of the experiment in two sentences.
    pub summary: fn(&ResultFile) -> String,
    /// Function that picks the key figures of the report from the results.
    pub key_figures: fn(&ResultFile) -> Vec<KeyFigure>,
    /// Description of the inputs of each network.
    pub describe: fn(Recipe) -> &'static str,
    /// Whether forecasts of the model with this name are drawn.
    pub draws: fn(&str) -> bool,
    /// Remarks below the results.
    pub notes: &'static [&'static str],
    /// Methods that were used: name, purpose, reference.
    pub methods: &'static [(&'static str, &'static str, &'static str)],
}
