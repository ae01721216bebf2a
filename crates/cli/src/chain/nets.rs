//! The nets of a chain: on the declared model and on the augmented one, same data and budget.

use crate::output::Output;
use crate::run_dir::{Config, DataSource};
use crate::session;
use augsim_trainer::{EngineSpec, NetModel, Recipe, Sequences, Settings};
use std::path::Path;

/// What all nets of a chain share.
pub struct Nets<'a> {
    /// The declared model.
    pub declared: EngineSpec,
    /// The model with what the loop found.
    pub augmented: EngineSpec,
    /// Where the training data come from.
    pub source: &'a DataSource,
    /// Training data.
    pub train: &'a Sequences,
    /// Directory for the runs.
    pub out: &'a Path,
    /// Iterations of each net.
    pub iterations: u64,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}

impl Nets<'_> {
    /// The trained nets with their names in the table; `None` if the user stopped it.
    pub fn train(&self, output: &Output) -> anyhow::Result<Option<Vec<(&'static str, NetModel)>>> {
        let plans = [
            ("Neural", "neural", Recipe::Neural, &self.declared),
            ("Hybrid", "hybrid", Recipe::Hybrid, &self.declared),
            ("Hybrid on augmented", "hybrid-augmented", Recipe::Hybrid, &self.augmented),
            ("Hybrid+", "hybrid-plus", Recipe::HybridPlus, &self.declared),
            ("Hybrid+ on augmented", "hybrid-plus-augmented", Recipe::HybridPlus, &self.augmented),
        ];
        let mut nets = Vec::new();
        for (label, folder, recipe, engine) in plans {
            output.note(format!("training {label} ({} iterations)", self.iterations));
            let settings = Settings::new(recipe, self.iterations, self.seed, engine.clone());
            let config = Config { checkpoint_every: 500, data: self.source.clone(), settings };
            match session::train_again(&self.out.join(folder), &config, self.train, self.resume, output)? {
                Some(trained) => nets.push((label, trained.model)),
                None => return Ok(None),
            }
        }
        Ok(Some(nets))
    }
}
