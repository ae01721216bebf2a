//! What an experiment is asked to do.

use super::result::ResultFile;
use augsim_report::page::KeyFigure;
use augsim_trainer::Recipe;
use std::path::PathBuf;

/// One net to train.
#[derive(Debug, Clone, Copy)]
pub struct NetPlan {
    /// Which.
    pub recipe: Recipe,
    /// Iterations.
    pub iterations: u64,
}

/// What is run: nets are trained on one set and scored on test sets, beside the physics. All else is there where it is asked
/// for.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Command that repeats it.
    pub command: String,
    /// Name of the only test set, which is of the paper's law: the floor is known, and nets reconstruct it.
    pub floor: Option<String>,
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
    /// What is said about it.
    pub words: Words,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}

/// What a page and the results say about an experiment.
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
    /// What a net reads.
    pub describe: fn(Recipe) -> &'static str,
    /// Whether forecasts of a model are drawn.
    pub draws: fn(&str) -> bool,
    /// Remarks.
    pub notes: &'static [&'static str],
    /// Methods: name, purpose, reference.
    pub methods: &'static [(&'static str, &'static str, &'static str)],
}

/// Sizes and iterations.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizes {
    /// Training pushes.
    pub train: usize,
    /// Test pushes on the training object and support.
    pub test: usize,
    /// Test pushes on each other support and object.
    pub transfer: usize,
    /// Training-set sizes of the curve, ascending; the last is `train`.
    pub sizes: Vec<usize>,
    /// Iterations of the paper's nets.
    pub paper_iterations: u64,
    /// Iterations of Hybrid+ and Neural+.
    pub plus_iterations: u64,
    /// Repeats of one push, truth and samples alike.
    pub repeats: usize,
    /// Training steps of the Gaussian processes.
    pub gp_steps: usize,
}

impl Sizes {
    /// The paper's numbers of pushes.
    pub fn full() -> Self {
        Sizes {
            train: 6500,
            test: 628,
            transfer: 300,
            sizes: vec![250, 1000, 2500, 6500],
            paper_iterations: 10_000,
            plus_iterations: 10_000,
            repeats: 2000,
            gp_steps: 800,
        }
    }

    /// A few minutes on two cores.
    pub fn quick() -> Self {
        Sizes {
            train: 1000,
            test: 150,
            transfer: 60,
            sizes: vec![250, 1000],
            paper_iterations: 1000,
            plus_iterations: 2000,
            repeats: 500,
            gp_steps: 400,
            ..Self::full()
        }
    }

    /// Iterations of a net.
    pub fn iterations(&self, recipe: Recipe) -> u64 {
        match recipe {
            Recipe::HybridPlus | Recipe::NeuralPlus => self.plus_iterations,
            _ => self.paper_iterations,
        }
    }

    /// The same with that many iterations for every net.
    pub fn with_iterations(self, iterations: u64) -> Self {
        Sizes { paper_iterations: iterations, plus_iterations: iterations, ..self }
    }
}
