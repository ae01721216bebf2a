//! Plan of an experiment: networks, data, tables.

use super::result::ResultFile;
use augsim_report::page::KeyFigure;
use augsim_trainer::Recipe;
use std::path::PathBuf;

/// One network to train.
#[derive(Debug, Clone, Copy)]
pub struct NetPlan {
    /// Recipe.
    pub recipe: Recipe,
    /// Number of training iterations.
    pub iterations: u64,
}

/// Plan of an experiment: networks are trained on one set and scored on test sets, next to the physics.
/// Other parts are optional.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Command that repeats the experiment.
    pub command: String,
    /// Name of the only test set. Its generating model is known, so the lower error bound and
    /// reconstructions are computed.
    pub floor: Option<String>,
    /// Whether models without training are scored as well.
    pub baselines: bool,
    /// Networks, in the order of the table.
    pub nets: Vec<NetPlan>,
    /// Training-set sizes of the learning curve, for networks with a plus.
    pub sizes: Vec<usize>,
    /// Number of training steps of the Gaussian processes of pushing.
    pub gp_steps: Option<usize>,
    /// Number of repetitions of one push in the laboratory, for truth and samples.
    pub repeats: Option<usize>,
    /// Folder of measured pusher-slider runs.
    pub runs: Option<PathBuf>,
    /// Whether the reduced version is run.
    pub quick: bool,
    /// Texts of the report.
    pub words: ExperimentTexts,
    /// Seed.
    pub seed: u64,
    /// Whether existing runs are continued.
    pub resume: bool,
}

/// Texts of the page and of the results of an experiment.
#[derive(Debug, Clone)]
pub struct ExperimentTexts {
    /// `ball` or `push`.
    pub scenario: &'static str,
    /// Kind of report.
    pub kind: &'static str,
    /// Title of the report.
    pub title: String,
    /// Function that summarises the outcome in two sentences.
    pub summary: fn(&ResultFile) -> String,
    /// Function of the key figures.
    pub key_figures: fn(&ResultFile) -> Vec<KeyFigure>,
    /// Description of the inputs of each network.
    pub describe: fn(Recipe) -> &'static str,
    /// Whether forecasts of a model are drawn.
    pub draws: fn(&str) -> bool,
    /// Remarks.
    pub notes: &'static [&'static str],
    /// Methods: name, purpose, reference.
    pub methods: &'static [(&'static str, &'static str, &'static str)],
}
