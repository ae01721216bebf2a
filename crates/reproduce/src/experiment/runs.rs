//! Measured runs of the pusher-slider (Hogan and Rodriguez 2016): windows of one second from training
//! and test runs.

use super::data::{Set, engine_of};
use super::rows::Row;
use anyhow::Context;
use augsim_data::Dataset;
use augsim_data::convert::CONVERTERS;
use augsim_data::push::resample;
use augsim_physics::model::PushModel;
use augsim_physics::push::Object;
use augsim_trainer::models::{Physics, Still, Zero};
use augsim_trainer::push::calibrate::{Calibration, calibrate};
use augsim_trainer::push::{Subsampling, pushes, windows};
use augsim_trainer::{
    Forecaster, NetModel, Protocol, Recipe, Sequences, Settings, Training, evaluate_forecast,
};
use std::path::Path;

/// Name of the data source in rows, and of its folder.
const DATA: &str = "mit-pusher-slider-runs";
/// Sampling rate of the windows in Hz.
const RATE_HZ: f64 = 25.0;
/// Number of samples of a window of one second, both ends included.
const SAMPLES: usize = 26;
/// Sampling intervals between the starts of consecutive windows: `[training, test]`.
///
/// Test windows overlap by half.
const WINDOW_STRIDES: [usize; 2] = [3, 13];
/// Every n-th run is held out as a test run.
const TEST_EVERY: usize = 3;
/// Number of training iterations of each network; small, because there are few runs.
const ITERATIONS: u64 = 1500;

/// Scores and calibration on the measured pusher-slider runs.
#[derive(Debug)]
pub struct Measured {
    /// Scores of all models on windows of the test runs.
    pub rows: Vec<Row>,
    /// Parameters of the physics that were fitted to the training runs.
    pub calibration: Calibration,
    /// Names of the measured runs that were held out for tests.
    pub test_runs: Vec<String>,
}

/// Returns the folder of the runs in `data`, or `data` itself, if it exists.
pub fn folder(data: &Path) -> Option<std::path::PathBuf> {
    let below = data.join(DATA);
    [below, data.to_owned()].into_iter().find(|p| p.join("index.csv").is_file() && p.join("runs").is_dir())
}

/// Calibrates the physics and trains the networks on training runs; scores all models on test runs.
pub fn train_and_score(folder: &Path, seed: u64, quick: bool) -> anyhow::Result<Measured> {
    let convert = CONVERTERS.iter().find(|(name, _)| *name == "mit-pusher-slider").map(|(_, c)| c);
    let convert = convert.context("no converter for the pusher-slider runs")?;
    let data = resample(&convert(folder)?.data, RATE_HZ)?;
    let declared = PushModel::textbook(Object::named("rect1").context("rect1 is built in")?);
    let declared = declared.with_nominal(|name| match name {
        "support_friction" => Some(0.35),
        "mass_kg" => Some(1.053),
        _ => None,
    });
    let (mut train, mut test, mut calm) = (Vec::new(), Vec::new(), Vec::new());
    for (i, t) in data.trajectories().iter().enumerate() {
        if i % TEST_EVERY == TEST_EVERY - 1 {
            test.push(i);
            // The names of runs show whether a hand knocked the object.
            if t.id().contains("NoPerturbations") {
                calm.push(i);
            }
        } else {
            train.push(i);
        }
    }
    let cut = |items: &[usize], every: usize| -> anyhow::Result<Sequences> {
        let set: Dataset = data.select(items);
        Ok(windows(&pushes(&set, Subsampling { samples: usize::MAX, rate_hz: RATE_HZ })?, SAMPLES, every))
    };
    let train = cut(&train, WINDOW_STRIDES[0])?;
    let calibration = calibrate(&declared, &train)?;
    let [engine, fitted] = [engine_of(declared)?, engine_of(calibration.model.clone())?];
    let set = |split, items| Set {
        on: Some(("square".into(), "table".into(), split)),
        engine: engine.clone(),
        items,
    };
    let mut sets = vec![set("test runs", cut(&test, WINDOW_STRIDES[1])?)];
    if !calm.is_empty() {
        sets.push(set("test runs without knocks", cut(&calm, WINDOW_STRIDES[1])?));
    }
    let mut nets = Vec::new();
    for (recipe, engine) in [
        (Recipe::Neural, &engine),
        (Recipe::NeuralPlus, &engine),
        (Recipe::Hybrid, &fitted),
        (Recipe::HybridPlus, &fitted),
    ] {
        let iterations = if quick { ITERATIONS / 4 } else { ITERATIONS };
        let mut training = Training::new(Settings::new(recipe, iterations, seed, engine.clone()), &train)?;
        while training.iteration() < iterations {
            training.step()?;
        }
        nets.push(NetModel::new(training.finish()?.clone())?);
    }
    let [nominal, fitted] = [engine.clone(), fitted].map(Physics);
    let whole = train.items.len();
    let mut models: Vec<(&str, &dyn Forecaster, usize)> = vec![
        ("Zero", &Zero, 0),
        ("Still", &Still, 0),
        ("Physics", &nominal, 0),
        ("Physics, fitted", &fitted, whole),
    ];
    models.extend(nets.iter().map(|n| (n.name(), n as &dyn Forecaster, whole)));
    let mut rows = Vec::new();
    for set in &sets {
        for &(label, model, trained) in &models {
            let score = evaluate_forecast(model, &set.items)?;
            rows.push(set.row(Some(DATA), label, Protocol::Forecast, trained, &score));
        }
    }
    let name = |i: &usize| data.trajectories()[*i].id().to_owned();
    Ok(Measured { rows, calibration, test_runs: test.iter().map(name).collect() })
}
