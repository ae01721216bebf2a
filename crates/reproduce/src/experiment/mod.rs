//! Runs an experiment: trains networks on one set, scores all models on all test sets, writes
//! `result.json` and `report.html`.

pub mod ball;
pub mod data;
pub mod layout;
mod page;
pub mod plan;
pub mod push;
mod repeat;
pub mod result;
pub mod rows;
mod runs;
mod sizes;

pub use plan::Experiment;
pub use result::table;
pub use runs::folder as runs_folder;
pub use sizes::Sizes;

use crate::reproduction::write_results;
use augsim_data::Dataset;
use augsim_physics::ball::drop_distribution::DropDistribution;
use augsim_physics::ball::floor::{ErrorFloorOptions, published_error_floor};
use augsim_session::run_dir::{Config, RunDir};
use augsim_session::training_run::Trained;
use augsim_terminal::destination::Claim;
use augsim_terminal::output::Output;
use augsim_terminal::training::{self, Times};
use augsim_trainer::models::{ExactDistribution, Physics, Still, Zero};
use augsim_trainer::push::{GpOptions, GpPush, Subsampling};
use augsim_trainer::{
    Correction, Forecaster, Losses, Protocol, Recipe, Settings, evaluate_forecast, evaluate_reconstruction,
};
use data::{Data, part};
use layout::Layout;
use page::{PageInputs, Scored};
use plan::NetPlan;
use repeat::{Clouds, compare};
use result::{CurvePoint, ResultFile};
use rows::Row;
use std::path::PathBuf;

/// Result and report of a finished experiment.
#[derive(Debug)]
pub struct Finished {
    /// Content of the file `result.json`.
    pub result: ResultFile,
    /// Path of the report of the experiment.
    pub report: PathBuf,
}

impl Finished {
    /// Prints the result as JSON, or the tables and the path of the report.
    pub fn print(&self, output: &Output) -> anyhow::Result<()> {
        output.result(&self.result, || format!("{}\nreport: {}", table(&self.result), self.report.display()))
    }
}

impl Experiment {
    /// Trains and scores all models in the claimed folder; returns `None` if interrupted.
    ///
    /// `truth` is the test set whose lower error bound is computed.
    pub fn run(
        &self,
        data: &Data,
        truth: Option<&Dataset>,
        claim: &Claim,
        output: &Output,
    ) -> anyhow::Result<Option<Finished>> {
        data.notes.iter().for_each(|note| output.note(note));
        claim.begin()?;
        let whole = data.train.items.len();
        let Some((nets, mut curve)) = self.train(data, claim, output)? else { return Ok(None) };
        let fit = |steps| {
            output.note("fitting the Gaussian processes");
            GpPush::fit(&data.engine, &data.train, GpOptions { steps, seed: self.seed })
        };
        let gp = self.gp_steps.map(fit).transpose()?;
        output.note("scoring");
        let (mut rows, scored) = self.score(data, truth, &nets, gp.as_ref())?;
        if !self.sizes.is_empty() {
            let last = |plan: &&NetPlan| rows.iter().find(|r| r.model == plan.recipe.label());
            let with_curve = self.nets.iter().filter(|p| in_curve(p.recipe));
            curve.extend(with_curve.filter_map(|p| last(&p)).map(|row| point(row, whole)));
            curve.sort_by(|a, b| (&a.model, a.train_pushes).cmp(&(&b.model, b.train_pushes)));
        }
        let clouds = self.clouds(gp.as_ref(), &nets, output)?;
        let (mut calibration, mut test_runs, mut notes) = (None, Vec::new(), data.notes.clone());
        if let Some(folder) = &self.runs {
            output.note(format!("measured runs: {}", folder.display()));
            let measured = runs::train_and_score(folder, self.seed, self.quick)?;
            rows.extend(measured.rows);
            (calibration, test_runs) = (Some(measured.calibration.estimates), measured.test_runs);
            notes.push("mit-pusher-slider-runs: windows of 1 s from the measured pose, 25 Hz".to_owned());
        }
        let thinning = Subsampling::default();
        let result = ResultFile {
            schema: "augsim.reproduce/1",
            scenario: self.words.scenario,
            test_set: self.floor.clone(),
            test_trajectories: self.floor.as_ref().map(|_| data.tests[0].items.items.len()),
            data: data.name,
            rows,
            curve,
            repeated: clouds.as_ref().map(|c| c.result.clone()),
            calibration,
            test_runs,
            thinning: data.engine.step_s().is_none().then_some([thinning.samples as f64, thinning.rate_hz]),
            iterations: self.nets.iter().map(|p| (p.recipe.label().to_owned(), p.iterations)).collect(),
            notes,
            seed: self.seed,
        };
        let html = |result: &ResultFile| {
            let inputs = PageInputs {
                losses: self.losses(claim, whole)?,
                gp: gp.as_ref(),
                scored,
                data,
                clouds: clouds.as_ref(),
                nets: &nets,
            };
            Ok(augsim_report::benchmark_report(&page::report(self, result, &inputs)?))
        };
        let report = write_results(claim, &result, html, Some(Times::from_trained(&nets)))?;
        Ok(Some(Finished { result, report }))
    }

    /// Trains all networks; returns those trained on the whole set and the points of the learning curve.
    ///
    /// Returns `None` if interrupted.
    fn train(
        &self,
        data: &Data,
        claim: &Claim,
        output: &Output,
    ) -> anyhow::Result<Option<(Vec<Trained>, Vec<CurvePoint>)>> {
        let whole = data.train.items.len();
        let mut nets = Vec::new();
        for plan in &self.nets {
            let Some(net) = self.net(plan, whole, data, claim, output)? else { return Ok(None) };
            nets.push(net);
        }
        let mut curve = Vec::new();
        for plan in self.nets.iter().filter(|p| in_curve(p.recipe)) {
            for &size in self.sizes.iter().filter(|&&size| size < whole) {
                let Some(t) = self.net(plan, size, data, claim, output)? else { return Ok(None) };
                let (set, name) = (&data.tests[0], t.model.name());
                let score = evaluate_forecast(&t.model, &set.items)?;
                curve.push(point(&set.row(data.name, name, Protocol::Forecast, size, &score), size));
            }
        }
        Ok(Some((nets, curve)))
    }

    /// Scores all models on all test sets; returns the rows and the scores on the first set.
    fn score(
        &self,
        data: &Data,
        truth: Option<&Dataset>,
        nets: &[Trained],
        gp: Option<&GpPush>,
    ) -> anyhow::Result<(Vec<Row>, Vec<Scored>)> {
        let whole = data.train.items.len();
        let (mut rows, mut scored) = (Vec::new(), Vec::new());
        for (k, set) in data.tests.iter().enumerate() {
            let physics = Physics(set.engine.clone());
            let gp = gp.map(|gp| gp.with_engine(&set.engine)).transpose()?;
            let nets = nets.iter().map(|t| t.model.with_engine(set.engine.clone()));
            let nets = nets.collect::<Result<Vec<_>, _>>()?;
            let mut models: Vec<(&dyn Forecaster, usize)> = Vec::new();
            if self.baselines {
                models.push((&Zero, 0));
                // The forecast without motion applies only to systems with actions, because the pusher
                // may miss the object.
                models.extend(gp.iter().map(|_| (&Still as &dyn Forecaster, 0)));
                models.push((&physics, 0));
            }
            models.extend(gp.iter().map(|gp| (gp as &dyn Forecaster, whole)));
            models.extend(nets.iter().map(|net| (net as &dyn Forecaster, whole)));
            for (model, trained) in models {
                let score = evaluate_forecast(model, &set.items)?;
                let row = set.row(data.name, model.name(), Protocol::Forecast, trained, &score);
                if k == 0 {
                    scored.push(Scored { name: row.model.clone(), protocol: row.protocol, score });
                }
                rows.push(row);
            }
            for net in nets.iter().filter(|net| net.state().settings.correction == Correction::Step) {
                let score = evaluate_reconstruction(net, &set.items)?;
                rows.push(set.row(data.name, net.name(), Protocol::Reconstruction, whole, &score));
            }
        }
        if let Some(truth) = truth {
            let set = &data.tests[0];
            rows.push(self.floor(Layout::for_engine(&set.engine), truth)?);
            let forecaster = ExactDistribution { law: DropDistribution::default(), seed: self.seed };
            let score = evaluate_forecast(&forecaster, &set.items)?;
            rows.push(set.row(data.name, forecaster.name(), Protocol::Floor, 0, &score));
            scored.push(Scored { name: forecaster.name().to_owned(), protocol: Protocol::Floor, score });
        }
        Ok((rows, scored))
    }

    /// Trains a network on the first `size` trajectories; returns `None` if interrupted.
    fn net(
        &self,
        plan: &NetPlan,
        size: usize,
        data: &Data,
        claim: &Claim,
        output: &Output,
    ) -> anyhow::Result<Option<Trained>> {
        let NetPlan { recipe, iterations } = *plan;
        let many = Layout::for_engine(&data.engine).words[1];
        output.note(format!("training {} on {size} {many} ({iterations} iterations)", recipe.label()));
        let train = part(&data.train, 0, size);
        let settings = Settings::new(recipe, iterations, self.seed, data.engine.clone());
        let config = Config {
            checkpoint_every: 500,
            data: data.source.clone(),
            accept: Vec::new(),
            residual_of: None,
            settings,
        };
        training::train_or_resume(&self.run_dir(claim, recipe, size), &config, &train, self.resume, output)
    }

    /// Returns the run directory of a network (by its recipe) for a training-set size.
    fn run_dir(&self, claim: &Claim, recipe: Recipe, size: usize) -> PathBuf {
        let name = recipe.label().to_lowercase().replace('+', "-plus");
        claim.folder().join(if self.sizes.is_empty() { name } else { format!("{name}-{size}") })
    }

    /// Reads the training losses of the networks that were trained on the whole set.
    fn losses(&self, claim: &Claim, whole: usize) -> anyhow::Result<Vec<(Recipe, Vec<Losses>)>> {
        let read =
            |p: &NetPlan| Ok((p.recipe, RunDir::open(&self.run_dir(claim, p.recipe, whole)).read_metrics()?));
        self.nets.iter().map(read).collect()
    }

    /// Makes the row with the lowest possible error of any forecast from the first state.
    fn floor(&self, layout: &'static Layout, truth: &Dataset) -> anyhow::Result<Row> {
        let options = ErrorFloorOptions { seed: self.seed, ..Default::default() };
        let floor = published_error_floor(&DropDistribution::default(), truth, options)?;
        let errors = [
            floor.weighted_median.trans_percent.mean,
            floor.median.position_m.mean,
            floor.median.velocity_m_s.mean,
        ];
        Ok(Row::floor(layout, errors, [floor.crps_height_m.mean, floor.crps_velocity_m_s.mean]))
    }

    /// Compares samples of models with the virtual laboratory on one repeated push; `None` if not planned.
    fn clouds(
        &self,
        gp: Option<&GpPush>,
        nets: &[Trained],
        output: &Output,
    ) -> anyhow::Result<Option<Clouds>> {
        let Some(repeats) = self.repeats else { return Ok(None) };
        output.note(format!("one push {repeats} times"));
        let gp = gp.iter().map(|gp| ("GP-SUM".to_owned(), *gp as &dyn Forecaster));
        let nets = nets.iter().map(|t| (t.model.name().to_owned(), &t.model as &dyn Forecaster));
        compare(repeats, self.seed, &gp.chain(nets).collect::<Vec<_>>()).map(Some)
    }
}

/// Whether a network is in the learning curve; the published networks predict no motion at every size.
fn in_curve(recipe: Recipe) -> bool {
    matches!(recipe, Recipe::NeuralPlus | Recipe::HybridPlus)
}

fn point(row: &Row, train_pushes: usize) -> CurvePoint {
    CurvePoint {
        model: row.model.clone(),
        train_pushes,
        pos_mm: row.number("pos_mm"),
        rot_deg: row.number("rot_deg"),
        crps_mm: row.number("crps_mm"),
    }
}
