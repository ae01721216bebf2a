//! The whole chain on pushing: pushes of the virtual laboratory, whose friction is not what the textbook model declares.

use super::nets::Nets;
use super::sets::{self, SetRow};
use crate::output::Output;
use crate::push::{Laboratory, Plan, Row};
use anyhow::Context;
use augsim_discovery::Discovery;
use augsim_physics::model::PushModel;
use augsim_trainer::models::{Physics, Zero};
use augsim_trainer::push::PushEngine;
use augsim_trainer::push::score::evaluate_pushes;
use augsim_trainer::{EngineSpec, Forecaster};
use serde::Serialize;
use std::path::Path;

/// Name of the set, and of the folder of its report.
pub const LABORATORY: &str = "push-laboratory";
/// Training pushes that the loop reads: more take longer and change no answer.
const LOOP_PUSHES: usize = 120;

/// What is run.
pub struct Chain<'a> {
    /// Directory for everything.
    pub out: &'a Path,
    /// Numbers of pushes, and their thinning.
    pub plan: Plan,
    /// Iterations of each net.
    pub iterations: u64,
    /// Seed.
    pub seed: u64,
    /// Go on with runs that are there.
    pub resume: bool,
}

/// What came of it.
#[derive(Debug, Serialize)]
pub struct Pushing {
    /// The discovery on training pushes.
    #[serde(flatten)]
    pub set: SetRow,
    /// The table on the test pushes.
    pub chain: Vec<Row>,
}

impl Chain<'_> {
    /// Closes the loop and makes the table; `None` if the user stopped it.
    pub fn run(&self, output: &Output) -> anyhow::Result<Option<Pushing>> {
        let lab = Laboratory::new(&self.plan, self.seed)?;
        let some: Vec<usize> = (0..LOOP_PUSHES.min(self.plan.train)).collect();
        let some = lab.data.select(&some);
        let set = sets::one(LABORATORY, &some, &lab.declared.to_toml(), self.out, self.seed, output)?;
        let textbook = PushEngine::of(&lab.declared).context("the laboratory's objects are built in")?;
        let calibrated = calibrated(&textbook, &set.found);
        let model = PushModel::parse(&set.found.model_toml, "the augmented model")?;
        let augmented = PushEngine::of(&model).context("the laboratory's objects are built in")?;

        let nets = Nets {
            declared: EngineSpec::Push(textbook.clone()),
            augmented: EngineSpec::Push(augmented.clone()),
            source: &lab.source,
            train: &lab.train,
            out: &self.out.join("chain-push"),
            iterations: self.iterations,
            seed: self.seed,
            resume: self.resume,
        };
        let Some(nets) = nets.train(output)? else { return Ok(None) };
        let (read, whole) = (some.trajectories().len(), lab.train.items.len());
        let [textbook, calibrated, augmented] =
            [textbook, calibrated, augmented].map(|engine| Physics(EngineSpec::Push(engine)));
        let mut models: Vec<(&str, &dyn Forecaster, usize)> = vec![
            ("Zero", &Zero, 0),
            ("Physics", &textbook, 0),
            ("Physics calibrated", &calibrated, read),
            ("Physics augmented", &augmented, read),
        ];
        models.extend(nets.iter().map(|(label, net)| (*label, net as &dyn Forecaster, whole)));
        let mut chain = Vec::new();
        for (label, model, trained) in models {
            let score = evaluate_pushes(model, &lab.test.pushes)?;
            chain.push(Row::new("virtual laboratory", label, &lab.test, trained, &score));
        }
        Ok(Some(Pushing { set, chain }))
    }
}

/// The declared model with the values that calibration alone gave.
fn calibrated(declared: &PushEngine, found: &Discovery) -> PushEngine {
    let value = |name: &str, declared: f64| found.calibrated.get(name).map_or(declared, |e| e.value);
    PushEngine {
        c_m: value("c_m", declared.c_m),
        contact_friction: value("contact_friction", declared.contact_friction),
        rod_radius_m: value("rod_radius_m", declared.rod_radius_m),
        ..declared.clone()
    }
}
