//! The nets of a chain: on the declared model and on the augmented one, same data and budget.

use crate::output::Output;
use crate::run_dir::{Config, DataSource};
use crate::session;
use augsim_trainer::{Engine, NetModel, Recipe, Sequences, Settings};
use std::path::Path;

/// How a chain is run.
#[derive(Debug, Clone, Copy)]
pub struct Runs<'a> {
    /// Directory for what comes of it.
    pub out: &'a Path,
    /// Iterations of each net.
    pub iterations: u64,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}

/// What all nets of a chain share.
pub struct Nets<'a> {
    /// The declared model.
    pub declared: Engine,
    /// The model with what the loop found.
    pub augmented: Engine,
    /// Where the training data come from.
    pub source: &'a DataSource,
    /// Training data.
    pub train: &'a Sequences,
    /// How and where they are trained.
    pub runs: Runs<'a>,
}

impl Nets<'_> {
    /// The trained nets with their names in the table; `None` if the user stopped it.
    pub fn train(&self, output: &Output) -> anyhow::Result<Option<Vec<(&'static str, NetModel)>>> {
        let Runs { out, iterations, seed, resume } = self.runs;
        let plans = [
            ("Neural", "neural", Recipe::Neural, &self.declared),
            ("Hybrid", "hybrid", Recipe::Hybrid, &self.declared),
            ("Hybrid on augmented", "hybrid-augmented", Recipe::Hybrid, &self.augmented),
            ("Hybrid+", "hybrid-plus", Recipe::HybridPlus, &self.declared),
            ("Hybrid+ on augmented", "hybrid-plus-augmented", Recipe::HybridPlus, &self.augmented),
        ];
        let mut nets = Vec::new();
        for (label, folder, recipe, engine) in plans {
            output.note(format!("training {label} ({iterations} iterations)"));
            let settings = Settings::new(recipe, iterations, seed, engine.clone());
            let config =
                Config { checkpoint_every: 500, data: self.source.clone(), accept: Vec::new(), settings };
            match session::train_again(&out.join(folder), &config, self.train, resume, output)? {
                Some(trained) => nets.push((label, trained.model)),
                None => return Ok(None),
            }
        }
        Ok(Some(nets))
    }
}
