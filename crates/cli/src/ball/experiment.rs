//! Trains the nets, scores every model on the test set, writes `result.json` and `report.html`.

use super::plan::{Experiment, NetPlan};
use super::report::report;
use super::result::{ResultFile, Scored};
use super::rows::{Errors, Row};
use super::{load, paper_engine, read, sequences};
use crate::destination::{Claim, REPORT, RESULT};
use crate::output::Output;
use crate::run_dir::{Config, RunDir};
use crate::session::{self, Times};
use augsim_data::Dataset;
use augsim_physics::ball::floor::{FloorOptions, paper_floor};
use augsim_physics::ball::paper_law::PaperLaw;
use augsim_trainer::models::{Law, Physics, Zero};
use augsim_trainer::{
    Forecaster, Protocol, Recipe, Sequences, Settings, evaluate_forecast, evaluate_reconstruction,
};
use std::path::PathBuf;

/// A finished experiment.
#[derive(Debug)]
pub struct Finished {
    /// What was written.
    pub result: ResultFile,
    /// The report's path.
    pub report: PathBuf,
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
            let settings = Settings::new(plan.recipe, plan.iterations, self.seed, engine.clone());
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
