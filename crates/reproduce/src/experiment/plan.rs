//! The plan of an experiment: nets, data, tables.

use super::result::ResultFile;
use augsim_report::page::KeyFigure;
use augsim_trainer::Recipe;
use std::path::PathBuf;

/// One net to train.
#[derive(Debug, Clone, Copy)]
pub struct NetPlan {
    /// Recipe of the net.
    pub recipe: Recipe,
    /// Iterations.
    pub iterations: u64,
}

/// The plan of an experiment: nets are trained on one set and scored on test sets, beside the physics. All else is there where
/// it is asked for.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Command that repeats it.
    pub command: String,
    /// Name of the only test set, which is of the paper's law: the floor is known, and nets reconstruct it.
    pub floor: Option<String>,
    /// Whether what needs no training is scored as well.
    pub baselines: bool,
    /// Nets, in the order of the table.
    pub nets: Vec<NetPlan>,
    /// Sizes of training sets of the curve of errors, on which the nets with a plus are trained too.
    pub sizes: Vec<usize>,
    /// Training steps of Gaussian processes of pushing.
    pub gp_steps: Option<usize>,
    /// Repeats of one push in the laboratory, truth and samples alike.
    pub repeats: Option<usize>,
    /// Measured runs of the pusher-slider.
    pub runs: Option<PathBuf>,
    /// Whether less of everything was asked for.
    pub quick: bool,
    /// Sentences about it.
    pub words: Words,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}

/// Sentences of a page and of the results about an experiment.
#[derive(Debug, Clone)]
pub struct Words {
    /// `ball` or `push`.
    pub scenario: &'static str,
    /// Kind of report.
    pub kind: &'static str,
    /// Title of the report.
    pub title: String,
    /// The outcome in two sentences.
    pub summary: fn(&ResultFile) -> String,
    /// Numbers in large type.
    pub key_figures: fn(&ResultFile) -> Vec<KeyFigure>,
    /// Columns that a net reads, in words.
    pub describe: fn(Recipe) -> &'static str,
    /// Whether forecasts of a model are drawn.
    pub draws: fn(&str) -> bool,
    /// Remarks.
    pub notes: &'static [&'static str],
    /// Methods: name, purpose, reference.
    pub methods: &'static [(&'static str, &'static str, &'static str)],
}
