//! A chain: physics as declared, calibrated and augmented, and nets on the declared and on the augmented one with the same
//! data and budget, all on one test set.

use crate::experiment::data::Set;
use crate::experiment::rows::Row;
use augsim_session::run_dir::{Config, DataSource};
use augsim_terminal::output::Output;
use augsim_terminal::training;
use augsim_trainer::models::{Physics, Zero};
use augsim_trainer::{
    Engine, Forecaster, NetModel, Protocol, Recipe, Sequences, Settings, evaluate_forecast,
};
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

/// Data, model and nets of a chain.
pub struct Chain<'a> {
    /// Where the trajectories come from, where rows say so.
    pub name: Option<&'static str>,
    /// The declared model.
    pub declared: Engine,
    /// The engine of the model with the values that calibration alone gave.
    pub calibrated: Engine,
    /// The model with what the loop found.
    pub augmented: Engine,
    /// Its forecasts, where they are not those of one roll-out.
    pub scattered: Option<&'a dyn Forecaster>,
    /// Trajectories that the loop read.
    pub read: usize,
    /// Where the training data come from.
    pub source: &'a DataSource,
    /// Training data.
    pub train: &'a Sequences,
    /// Test data, which neither the loop nor a net has seen.
    pub test: &'a Set,
    /// How and where nets are trained.
    pub runs: Runs<'a>,
}

impl Chain<'_> {
    /// The table on the test set; `None` if the user stopped it.
    pub fn run(&self, output: &Output) -> anyhow::Result<Option<Vec<Row>>> {
        let Some(nets) = self.train(output)? else { return Ok(None) };
        let [declared, calibrated, augmented] =
            [&self.declared, &self.calibrated, &self.augmented].map(|engine| Physics(engine.clone()));
        let mut models: Vec<(&str, &dyn Forecaster, usize)> = vec![
            ("Zero", &Zero, 0),
            ("Physics", &declared, 0),
            ("Physics calibrated", &calibrated, self.read),
            ("Physics augmented", self.scattered.unwrap_or(&augmented), self.read),
        ];
        let whole = self.train.items.len();
        models.extend(nets.iter().map(|(label, net)| (*label, net as &dyn Forecaster, whole)));
        let row = |(label, model, trained): (&str, &dyn Forecaster, usize)| {
            let score = evaluate_forecast(model, &self.test.items)?;
            Ok(self.test.row(self.name, label, Protocol::Forecast, trained, &score))
        };
        models.into_iter().map(row).collect::<anyhow::Result<_>>().map(Some)
    }

    /// The trained nets with their names in the table; `None` if the user stopped it.
    fn train(&self, output: &Output) -> anyhow::Result<Option<Vec<(&'static str, NetModel)>>> {
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
            let config = Config {
                checkpoint_every: 500,
                data: self.source.clone(),
                accept: Vec::new(),
                residual_of: None,
                settings,
            };
            match training::train_again(&out.join(folder), &config, self.train, resume, output)? {
                Some(trained) => nets.push((label, trained.model)),
                None => return Ok(None),
            }
        }
        Ok(Some(nets))
    }
}
