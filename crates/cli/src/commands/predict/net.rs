//! `augsim predict RUN`: forecasts of a trained network.

use super::model::write_predictions;
use crate::args::Predict;
use augsim_data::write_dataset;
use augsim_discovery::PredictOptions;
use augsim_session::predict::predict_with_net;
use augsim_session::run_dir::{FILES, RunDir};
use augsim_session::{forecast, run_data};
use augsim_terminal::Outcome;
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use augsim_trainer::NetModel;
use serde::Serialize;
use std::path::PathBuf;

/// Default number of random draws of each trajectory's forecast.
const DRAWS: u32 = 100;

#[derive(Serialize)]
struct Written {
    forecast: PathBuf,
    trajectories: usize,
    samples: usize,
}

/// Forecasts the data with a trained network and writes the prediction bands.
pub(super) fn run(args: &Predict, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let run = RunDir::open(&args.run);
    let trained = FILES.map(|name| run.file(name));
    let inputs = args.inputs(trained.iter().map(PathBuf::as_path));
    data_file(&args.out, &[], &inputs)?;
    let model = NetModel::new(run.read_model()?)?;
    if model.state().settings.engine.equation_engine().is_some() {
        let draws = args.samples.unwrap_or(DRAWS) as usize;
        let options = PredictOptions { seed, draws, only: None };
        let all = predict_with_net(&model, &args.measured(), args.burn_in as usize, &options)?;
        return write_predictions(args, &all, draws, false, output);
    }
    let (starts, times) = run_data::load_timed(&args.measured(), &model.state().settings.engine)?;
    let samples = args.samples.unwrap_or(DRAWS) as usize;
    let bands = forecast::bands(&model, &starts, &times, samples)?;
    write_dataset(&bands, &args.out)?;
    let written = Written { forecast: args.out.clone(), trajectories: starts.items.len(), samples };
    output.result(&written, || {
        format!(
            "{} forecasts from the first state, {} samples each: {}",
            written.trajectories,
            samples,
            written.forecast.display()
        )
    })?;
    Ok(Outcome::Done)
}
