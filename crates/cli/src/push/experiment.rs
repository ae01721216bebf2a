//! Trains the nets, scores every model on every set, writes `result.json` and `report.html`.

use super::data::{PushData, part};
use super::plan::Experiment;
use super::repeat::{Clouds, compare};
use super::report::report;
use super::result::{CurvePoint, Drawn, ResultFile};
use super::rows::Row;
use super::runs::{Measured, measured};
use crate::destination::{Claim, REPORT, RESULT};
use crate::exit::Usage;
use crate::output::Output;
use crate::run_dir::{Config, RunDir};
use crate::session::{self, Times, Trained};
use augsim_trainer::models::{Physics, Still, Zero};
use augsim_trainer::push::score::{PushScore, evaluate_pushes};
use augsim_trainer::push::{GpOptions, GpPush};
use augsim_trainer::{EngineSpec, Forecaster, Losses, NetModel, Recipe, Settings};
use std::path::PathBuf;

/// Nets trained on the whole training set.
const NETS: [Recipe; 4] = [Recipe::Neural, Recipe::NeuralPlus, Recipe::Hybrid, Recipe::HybridPlus];
/// Nets of the training-set-size curve: the published ones forecast that nothing moves, whatever they were trained on.
const CURVE: [Recipe; 2] = [Recipe::NeuralPlus, Recipe::HybridPlus];

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
        let plan = &self.plan;
        let data = match &self.published {
            Some(folder) => PushData::published(folder, plan, self.seed)?,
            None => {
                output.note("no published files: making pushes in the virtual laboratory");
                PushData::laboratory(plan, self.seed)?
            }
        };
        for note in &data.notes {
            output.note(note);
        }
        let whole = self.train_size(data.train.items.len())?;
        claim.begin()?;
        let recipes = self.one.map_or(NETS.to_vec(), |one| vec![one.recipe]);
        let mut nets = Vec::new();
        for &recipe in &recipes {
            match self.net(recipe, whole, &data, claim, output)? {
                Some(t) => nets.push(t),
                None => return Ok(None),
            }
        }
        let mut curve = Vec::new();
        for recipe in CURVE.into_iter().filter(|_| self.one.is_none()) {
            for &size in plan.sizes.iter().filter(|&&size| size < whole) {
                let Some(t) = self.net(recipe, size, &data, claim, output)? else { return Ok(None) };
                curve.push(point(recipe, size, &evaluate_pushes(&t.model, &data.tests[0].pushes)?));
            }
        }
        let gp = match self.one {
            Some(_) => None,
            None => {
                output.note("fitting the Gaussian processes");
                let options = GpOptions { steps: plan.gp_steps, seed: self.seed };
                Some(GpPush::fit(&data.engine, &data.train, options)?)
            }
        };
        output.note("scoring");
        let mut rows = Vec::new();
        let mut over_push = Vec::new();
        for (k, set) in data.tests.iter().enumerate() {
            let physics = Physics(EngineSpec::Push(set.engine.clone()));
            let gp = gp.as_ref().map(|gp| gp.with_engine(&set.engine));
            let moved: Vec<NetModel> = nets
                .iter()
                .map(|t| t.model.with_engine(EngineSpec::Push(set.engine.clone())))
                .collect::<Result<_, _>>()?;
            let mut models: Vec<(&dyn Forecaster, usize)> = Vec::new();
            if let Some(gp) = &gp {
                models = vec![(&Zero, 0), (&Still, 0), (&physics, 0), (gp, whole)];
            }
            models.extend(moved.iter().map(|m| (m as &dyn Forecaster, whole)));
            for (model, trained) in models {
                let score = evaluate_pushes(model, &set.pushes)?;
                rows.push(Row::new(data.name, model.name(), set, trained, &score));
                if k == 0 {
                    if !matches!(model.name(), "Zero" | "Still") {
                        over_push.push((model.name().to_owned(), score.over_push.clone()));
                    }
                    if let Some(recipe) = CURVE.into_iter().find(|r| r.label() == model.name()) {
                        curve.push(point(recipe, whole, &score));
                    }
                }
            }
        }
        curve.sort_by(|a, b| (&a.model, a.train_pushes).cmp(&(&b.model, b.train_pushes)));
        let clouds = match &gp {
            Some(gp) => self.clouds(gp, &nets, output)?,
            None => None,
        };
        let runs = if self.one.is_none() { self.measured(output)? } else { None };
        let mut notes = data.notes.clone();
        let (mut calibration, mut test_runs) = (None, Vec::new());
        if let Some(m) = runs {
            rows.extend(m.rows);
            (calibration, test_runs) = (Some(m.calibration.estimates), m.test_runs);
            notes.push("mit-pusher-slider-runs: windows of 1 s from the measured pose, 25 Hz".to_owned());
        }
        let result = ResultFile {
            schema: "augsim.reproduce/1",
            scenario: "push",
            data: data.name,
            rows,
            curve,
            repeated: clouds.as_ref().map(|c| c.result.clone()),
            calibration,
            test_runs,
            thinning: [plan.thinning.samples as f64, plan.thinning.rate_hz],
            iterations: [plan.paper_iterations, plan.plus_iterations],
            notes,
            seed: self.seed,
        };
        claim.write(RESULT, &serde_json::to_string_pretty(&result)?)?;
        let drawn = Drawn {
            losses: losses(claim, &recipes, whole)?,
            others: gp.iter().map(|gp| gp as &dyn Forecaster).collect(),
            over_push,
            test: &data.tests[0].pushes,
            clouds: clouds.as_ref(),
            nets: &nets,
        };
        let html = augsim_report::push_report(&report(self, &result, &drawn)?);
        let path = claim.write(REPORT, &html)?;
        claim.write_timing(Times::of(&nets))?;
        Ok(Some(Finished { result, report: path }))
    }

    /// Training pushes out of those that there are.
    fn train_size(&self, there: usize) -> anyhow::Result<usize> {
        match self.one.and_then(|one| one.train_size) {
            Some(wish) if wish > there => {
                let text = format!("--train-size {wish}: there are {there} training pushes");
                Err(Usage(text).into())
            }
            wish => Ok(wish.unwrap_or(there)),
        }
    }

    /// Trains a net on the first `size` pushes; `None` if the user stopped it.
    fn net(
        &self,
        recipe: Recipe,
        size: usize,
        data: &PushData,
        claim: &Claim,
        output: &Output,
    ) -> anyhow::Result<Option<Trained>> {
        let iterations = match recipe {
            Recipe::HybridPlus | Recipe::NeuralPlus => self.plan.plus_iterations,
            _ => self.plan.paper_iterations,
        };
        output.note(format!("training {} on {size} pushes ({iterations} iterations)", recipe.label()));
        let train = part(&data.train, 0, size);
        let settings = Settings::push(recipe, iterations, self.seed, data.engine.clone());
        let config =
            Config { checkpoint_every: 1000, data: data.source.clone(), accept: Vec::new(), settings };
        session::train_again(&run_dir(claim, recipe, size), &config, &train, self.resume, output)
    }

    /// The repeated push, which only the laboratory has.
    fn clouds(&self, gp: &GpPush, nets: &[Trained], output: &Output) -> anyhow::Result<Option<Clouds>> {
        if self.published.is_some() {
            return Ok(None);
        }
        output.note(format!("one push {} times", self.plan.repeats));
        let mut models: Vec<(String, &dyn Forecaster)> = vec![("GP-SUM".to_owned(), gp)];
        models.extend(nets.iter().map(|t| (t.model.name().to_owned(), &t.model as &dyn Forecaster)));
        compare(&self.plan, self.seed, &models).map(Some)
    }

    fn measured(&self, output: &Output) -> anyhow::Result<Option<Measured>> {
        let Some(folder) = &self.runs else { return Ok(None) };
        output.note(format!("measured runs: {}", folder.display()));
        measured(folder, self.seed, self.quick).map(Some)
    }
}

/// Where a net is trained on the first `size` pushes.
fn run_dir(claim: &Claim, recipe: Recipe, size: usize) -> PathBuf {
    claim.folder().join(format!("{}-{size}", recipe.label().to_lowercase().replace('+', "-plus")))
}

/// Losses of the nets that were trained on `whole` pushes.
fn losses(claim: &Claim, recipes: &[Recipe], whole: usize) -> anyhow::Result<Vec<(Recipe, Vec<Losses>)>> {
    let read = |&r: &Recipe| Ok((r, RunDir::open(&run_dir(claim, r, whole)).read_metrics()?));
    recipes.iter().map(read).collect()
}

fn point(recipe: Recipe, train_pushes: usize, score: &PushScore) -> CurvePoint {
    CurvePoint {
        model: recipe.label().to_owned(),
        train_pushes,
        pos_mm: score.mean.pos_mm,
        rot_deg: score.mean.rot_deg,
        crps_mm: score.crps_mm,
    }
}
