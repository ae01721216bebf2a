//! The whole chain on the ball: from a model that is almost right to the net on the augmented model.

use super::nets::{Nets, Runs};
use crate::ball::{Row, load, paper_engine};
use crate::output::Output;
use crate::run_dir::DataSource;
use augsim_discovery::Discovery;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::ball::paper_law;
use augsim_physics::effects::SCATTER_KIND;
use augsim_physics::system::ScatterPer;
use augsim_trainer::models::{Physics, ScatteredBall, Zero};
use augsim_trainer::{EngineSpec, Forecaster, Protocol, evaluate_forecast};
use std::path::Path;

/// What is run.
pub struct Chain<'a> {
    /// Folder with `train.csv.gz` and `test_1000.csv.gz`.
    pub data: &'a Path,
    /// What the loop found in training drops.
    pub found: &'a Discovery,
    /// How it is run.
    pub runs: Runs<'a>,
}

impl Chain<'_> {
    /// The table on `test_1000`; `None` if the user stopped it.
    pub fn run(&self, output: &Output) -> anyhow::Result<Option<Vec<Row>>> {
        let train = DataSource::File(self.data.join("train.csv.gz"));
        let test = DataSource::File(self.data.join("test_1000.csv.gz"));
        let [train_data, test] = [load(&train, &paper_engine())?, load(&test, &paper_engine())?];
        let (nominal, calibrated) = (paper_law::paper_engine(), self.calibrated());
        let augmented = self.augmented();
        let nets = Nets {
            declared: paper_engine(),
            augmented: EngineSpec::PybulletBall(augmented.ball),
            source: &train,
            train: &train_data,
            runs: self.runs,
        };
        let Some(nets) = nets.train(output)? else { return Ok(None) };
        let physics = |ball: BulletBall| Physics(EngineSpec::PybulletBall(ball));
        let (declared, fitted) = (physics(nominal), physics(calibrated));
        let points: [(&str, &dyn Forecaster); 3] =
            [("Zero", &Zero), ("Physics", &declared), ("Physics calibrated", &fitted)];
        let mut rows = Vec::new();
        for (label, model) in points {
            rows.push(Row::of_point(label, &evaluate_forecast(model, &test)?));
        }
        rows.push(Row::of_net(
            "Physics augmented",
            Protocol::Forecast,
            &evaluate_forecast(&augmented, &test)?,
        ));
        for (label, model) in &nets {
            rows.push(Row::of_net(label, Protocol::Forecast, &evaluate_forecast(model, &test)?));
        }
        Ok(Some(rows))
    }

    /// PyBullet's engine with the calibrated restitution and damping. What else the loop adds describes how the stepping
    /// scheme differs from the exact engine: the stepping engine has it already.
    fn calibrated(&self) -> BulletBall {
        self.with(|name| self.found.calibrated.get(name).map(|e| e.value))
    }

    fn augmented(&self) -> ScatteredBall {
        let ball = self.with(|name| self.found.parameters.get(name).map(|e| e.value));
        let scatter = self.found.effects.iter().find(|e| e.kind == SCATTER_KIND);
        let per = match scatter.and_then(|e| e.per.as_deref()) {
            Some("impact") => ScatterPer::Event,
            _ => ScatterPer::Record,
        };
        let sd = scatter.and_then(|e| e.parameters.get("sd")).map_or(0.0, |e| e.value);
        ScatteredBall { ball, sd, per, seed: self.runs.seed }
    }

    fn with(&self, value: impl Fn(&str) -> Option<f64>) -> BulletBall {
        let nominal = paper_law::paper_engine();
        BulletBall {
            restitution: value("restitution").unwrap_or(nominal.restitution),
            // Bullet has one damping for both laws of drag.
            damping: value("linear-drag.c_per_s").unwrap_or(nominal.damping),
            ..nominal
        }
    }
}
