//! Trains the nets, scores every model on the test set, writes `result.json` and `report.html`.

use super::report::report;
use super::rows::{Errors, Row};
use super::{load, paper_engine, read, sequences};
use crate::destination::{Claim, REPORT, RESULT};
use crate::output::Output;
use crate::run_dir::{Config, DataSource, RunDir};
use crate::session::{self, Times};
use augsim_data::Dataset;
use augsim_physics::ball::floor::{FloorOptions, paper_floor};
use augsim_physics::ball::paper_law::PaperLaw;
use augsim_trainer::models::{Law, Physics, Zero};
use augsim_trainer::score::Score;
use augsim_trainer::{
    Forecaster, Protocol, Recipe, Sequences, Settings, evaluate_forecast, evaluate_reconstruction,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One net to train.
#[derive(Debug, Clone, Copy)]
pub struct NetPlan {
    /// Which.
    pub recipe: Recipe,
    /// Iterations.
    pub iterations: u64,
}

/// What is run.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Title of the report.
    pub title: String,
    /// Command that repeats it.
    pub command: String,
    /// Training data.
    pub train: DataSource,
    /// Test data, of the paper's law: never trained on.
    pub test: DataSource,
    /// Name of the test set in the table.
    pub test_name: String,
    /// Nets, in the order of the table.
    pub nets: Vec<NetPlan>,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}

/// What `result.json` holds.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    /// `augsim.reproduce/1`.
    pub schema: &'static str,
    /// `ball`.
    pub scenario: &'static str,
    /// Test set.
    pub test_set: String,
    /// Trajectories in it.
    pub test_trajectories: usize,
    /// The table.
    pub rows: Vec<Row>,
    /// Iterations, by model.
    pub iterations: BTreeMap<String, u64>,
    /// Seed.
    pub seed: u64,
}

/// A finished experiment.
#[derive(Debug)]
pub struct Finished {
    /// What was written.
    pub result: ResultFile,
    /// The report's path.
    pub report: PathBuf,
}

/// A scored model, for the table and the figures.
pub struct Scored<'a> {
    /// The predictor.
    pub model: &'a dyn Forecaster,
    /// Its forecast scores.
    pub score: Score,
}

impl Experiment {
    /// Runs it into the claimed folder; `None` if the user stopped it (run again with `--resume`).
    pub fn run(&self, claim: &Claim, output: &Output) -> anyhow::Result<Option<Finished>> {
        let engine = paper_engine();
        let (train, test_data) = (load(&self.train, &engine)?, read(&self.test, &engine)?);
        let test = sequences(&test_data)?;
        claim.begin()?;
        let mut trained = Vec::new();
        for plan in &self.nets {
            output.note(format!("training {} ({} iterations)", plan.recipe.label(), plan.iterations));
            let settings = Settings::ball(plan.recipe, plan.iterations, self.seed, engine.clone());
            let config =
                Config { checkpoint_every: 500, data: self.train.clone(), accept: Vec::new(), settings };
            let folder = run_dir(claim, plan.recipe);
            match session::train_again(&folder, &config, &train, self.resume, output)? {
                Some(t) => trained.push(t),
                None => return Ok(None),
            }
        }
        output.note(format!("scoring on {} trajectories of {}", test.items.len(), self.test_name));
        let law = Law { law: PaperLaw::default(), seed: self.seed };
        let physics = Physics(engine);
        let mut rows = Vec::new();
        let mut scored: Vec<Scored<'_>> = Vec::new();
        let points: [&dyn Forecaster; 2] = [&Zero, &physics];
        for model in points {
            let score = evaluate_forecast(model, &test)?;
            rows.push(Row::of_point(model.name(), &score));
            scored.push(Scored { model, score });
        }
        for t in &trained {
            let score = evaluate_forecast(&t.model, &test)?;
            rows.push(Row::of_net(t.model.name(), Protocol::Forecast, &score));
            scored.push(Scored { model: &t.model, score });
        }
        for t in &trained {
            let score = evaluate_reconstruction(&t.model, &test)?;
            rows.push(Row::of_net(t.model.name(), Protocol::Reconstruction, &score));
        }
        rows.push(self.floor(&test_data)?);
        let score = evaluate_forecast(&law, &test)?;
        rows.push(Row::of_net(law.name(), Protocol::Floor, &score));
        scored.push(Scored { model: &law, score });

        let result = self.result(&test, rows);
        claim.write(RESULT, &serde_json::to_string_pretty(&result)?)?;
        let curves = self.learning_curves(claim)?;
        let html = augsim_report::training_report(&report(self, &result, &trained, &scored, &test, &curves)?);
        let path = claim.write(REPORT, &html)?;
        claim.write_timing(Times::of(&trained))?;
        Ok(Some(Finished { result, report: path }))
    }

    fn learning_curves(&self, claim: &Claim) -> anyhow::Result<Vec<(Recipe, Vec<augsim_trainer::Losses>)>> {
        let read =
            |plan: &NetPlan| Ok((plan.recipe, RunDir::open(&run_dir(claim, plan.recipe)).read_metrics()?));
        self.nets.iter().map(read).collect()
    }

    /// The best that any predictor can do from the first state.
    fn floor(&self, test: &Dataset) -> anyhow::Result<Row> {
        let options = FloorOptions { seed: self.seed, ..Default::default() };
        let floor = paper_floor(&PaperLaw::default(), test, options)?;
        let errors = Errors {
            trans_percent: floor.weighted_median.trans_percent.mean,
            pos_m: floor.median.position_m.mean,
            vel_m_s: floor.median.velocity_m_s.mean,
        };
        Ok(Row::of_floor(errors, [floor.crps_height_m.mean, floor.crps_velocity_m_s.mean]))
    }

    fn result(&self, test: &Sequences, rows: Vec<Row>) -> ResultFile {
        ResultFile {
            schema: "augsim.reproduce/1",
            scenario: "ball",
            test_set: self.test_name.clone(),
            test_trajectories: test.items.len(),
            rows,
            iterations: self.nets.iter().map(|p| (p.recipe.label().to_owned(), p.iterations)).collect(),
            seed: self.seed,
        }
    }
}

/// Where a net is trained.
fn run_dir(claim: &Claim, recipe: Recipe) -> PathBuf {
    claim.folder().join(recipe.label().to_lowercase().replace('+', "-plus"))
}
