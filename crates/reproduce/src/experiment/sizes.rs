//! Data sizes and numbers of iterations for the reproduction of pushing.

use augsim_trainer::Recipe;

/// Numbers of pushes, iterations and repetitions of the experiment with pushes.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizes {
    /// Number of training pushes.
    pub train: usize,
    /// Number of test pushes with the training object and surface.
    pub test: usize,
    /// Number of test pushes on each other surface and object.
    pub transfer: usize,
    /// Training-set sizes of the learning curve, ascending; the last is `train`.
    pub sizes: Vec<usize>,
    /// Number of training iterations of the networks of the paper (Neural and Hybrid).
    pub paper_iterations: u64,
    /// Number of training iterations of Hybrid+ and Neural+.
    pub plus_iterations: u64,
    /// Number of repetitions of one push, for the true set and for the samples of each model.
    pub repeats: usize,
    /// Number of training steps of the Gaussian processes of pushing.
    pub gp_steps: usize,
}

impl Sizes {
    /// Returns the data sizes and numbers of iterations of the paper.
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

    /// Returns reduced data sizes and numbers of iterations, which take a few minutes on two cores.
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

    /// Returns the number of training iterations of a network.
    pub fn iterations(&self, recipe: Recipe) -> u64 {
        match recipe {
            Recipe::HybridPlus | Recipe::NeuralPlus => self.plus_iterations,
            _ => self.paper_iterations,
        }
    }

    /// Sets the number of iterations of all networks.
    pub fn with_iterations(self, iterations: u64) -> Self {
        Sizes { paper_iterations: iterations, plus_iterations: iterations, ..self }
    }
}
