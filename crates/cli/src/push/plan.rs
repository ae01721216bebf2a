//! How much of everything a reproduction takes.

use augsim_trainer::Recipe;
use augsim_trainer::push::Thinning;
use std::path::PathBuf;

/// Sizes and iterations.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
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
    /// Thinning of every push.
    pub thinning: Thinning,
}

impl Plan {
    /// The paper's numbers of pushes.
    pub fn full() -> Self {
        Plan {
            train: 6500,
            test: 628,
            transfer: 300,
            sizes: vec![250, 1000, 2500, 6500],
            paper_iterations: 10_000,
            plus_iterations: 10_000,
            repeats: 2000,
            gp_steps: 800,
            thinning: Thinning::default(),
        }
    }

    /// A few minutes on two cores.
    pub fn quick() -> Self {
        Plan {
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

    /// The same with that many iterations for every net.
    pub fn with_iterations(self, iterations: u64) -> Self {
        Plan { paper_iterations: iterations, plus_iterations: iterations, ..self }
    }
}

/// One net instead of the whole experiment: a point of the size curve, with its scores on every set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OneNet {
    /// Which.
    pub recipe: Recipe,
    /// Training pushes, the first ones; all without a number.
    pub train_size: Option<usize>,
}

/// What is run.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Command that repeats it.
    pub command: String,
    /// How much of everything.
    pub plan: Plan,
    /// Published files, where there are any.
    pub published: Option<PathBuf>,
    /// Measured runs of the pusher-slider, where there are any.
    pub runs: Option<PathBuf>,
    /// Whether less of everything was asked for.
    pub quick: bool,
    /// One net instead of all that follows from the plan.
    pub one: Option<OneNet>,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}
