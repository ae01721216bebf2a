//! How much of everything a reproduction of pushing takes.

use augsim_trainer::Recipe;

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
        }
    }

    /// Iterations of a net.
    pub fn iterations(&self, recipe: Recipe) -> u64 {
        match recipe {
            Recipe::HybridPlus | Recipe::NeuralPlus => self.plus_iterations,
            _ => self.paper_iterations,
        }
    }

    /// Sets the iterations of every net.
    pub fn with_iterations(self, iterations: u64) -> Self {
        Sizes { paper_iterations: iterations, plus_iterations: iterations, ..self }
    }
}
