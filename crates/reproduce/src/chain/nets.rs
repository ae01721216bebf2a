//! Scores of the declared, calibrated and augmented physics, and of networks on the declared and
//! augmented models, on one test set. All networks have the same data and number of iterations.

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

/// Output folder, iterations and seed of the networks of one table.
#[derive(Debug, Clone, Copy)]
pub struct Runs<'a> {
    /// Folder to which the training runs are written.
    pub out: &'a Path,
    /// Number of training iterations of each network.
    pub iterations: u64,
    /// Seed of the training of each network.
    pub seed: u64,
    /// Whether existing training runs are continued.
    pub resume: bool,
}

/// Data and models of one table: declared, calibrated and augmented physics, and networks on them.
pub struct Chain<'a> {
    /// Name of the data source in the rows; `None` if rows have none.
    pub name: Option<&'static str>,
    /// Simulator of the declared model.
    pub declared: Engine,
    /// Simulator of the declared model with calibrated parameters.
    pub calibrated: Engine,
    /// Simulator of the augmented model (declared model and discovered effects).
    pub augmented: Engine,
    /// Forecasts of the augmented model if they need samples (random effects); `None` for a single roll-out.
    pub scattered: Option<&'a dyn Forecaster>,
    /// Number of trajectories that the discovery read.
    pub read: usize,
    /// Source of the training data of the networks.
    pub source: &'a DataSource,
    /// Training data of the networks.
    pub train: &'a Sequences,
    /// Test data, not used by the discovery or the networks.
    pub test: &'a Set,
    /// Output folder, iterations and seed of the networks.
    pub runs: Runs<'a>,
}

impl Chain<'_> {
    /// Trains the networks and scores all models on the test set; returns the rows, or `None` if interrupted.
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

    /// Trains the networks and returns them with their names in the table; `None` if interrupted.
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
            match training::train_or_resume(&out.join(folder), &config, self.train, resume, output)? {
                Some(trained) => nets.push((label, trained.model)),
                None => return Ok(None),
            }
        }
        Ok(Some(nets))
    }
}
