//! `augsim predict MODEL`: forecasts of a model file.

use crate::args::Predict;
use crate::commands::note_reading;
use augsim_data::write_dataset;
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_session::Subject;
use augsim_session::predict::{self, table};
use augsim_terminal::Outcome;
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    forecast: PathBuf,
    trajectories: usize,
    samples: usize,
    /// Description of the samples that the initial state was estimated from.
    start: String,
    errors: Vec<Error>,
    coverage50: f64,
    coverage90: f64,
}

#[derive(Serialize)]
struct Error {
    measure: String,
    rmse: f64,
    ci95: [f64; 2],
    unit: String,
}

/// Forecasts with the model in `file`.
pub(super) fn run(args: &Predict, file: &Path, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    data_file(&args.out, &[], &[file, &args.data])?;
    let model = Subject::read(file)?;
    let draws = args.samples.map_or(predict::DRAWS, |n| n as usize);
    let options = PredictOptions { seed, draws, only: None };
    let data = args.time.of(&args.data);
    let all = predict::predict(&model, &data, args.burn_in as usize, &options)?;
    if let Subject::Equations(model) = &model {
        note_reading(&data, model, output)?;
    }
    write_predictions(args, &all, draws, output)
}

/// Writes the bands and prints the errors.
pub(super) fn write_predictions(
    args: &Predict,
    all: &PredictionSet,
    draws: usize,
    output: &Output,
) -> anyhow::Result<Outcome> {
    write_dataset(&table::bands(all)?, &args.out)?;
    let written = summary(args, all, draws);
    output.result(&written, || forecast_text(&written))?;
    Ok(Outcome::Done)
}

fn summary(args: &Predict, all: &PredictionSet, draws: usize) -> Written {
    let errors = all.errors.iter().map(|e| Error {
        measure: e.measure.clone(),
        rmse: e.rmse,
        ci95: e.ci95,
        unit: e.unit.clone(),
    });
    Written {
        forecast: args.out.clone(),
        trajectories: all.records.len(),
        samples: draws,
        start: all.start.clone(),
        errors: errors.collect(),
        coverage50: all.coverage(0.5).0,
        coverage90: all.coverage(0.9).0,
    }
}

fn forecast_text(w: &Written) -> String {
    let noun = if w.trajectories == 1 { "forecast" } else { "forecasts" };
    let mut text = format!(
        "{} {noun} from {}, {} draws each: {}",
        w.trajectories,
        w.start,
        w.samples,
        w.forecast.display()
    );
    for e in &w.errors {
        let unit = if e.unit.is_empty() { String::new() } else { format!(" {}", e.unit) };
        let [low, high] = e.ci95;
        text += &format!(
            "\n  {}: root mean square error {:.4e}{unit} (95 % interval {low:.4e} to {high:.4e})",
            e.measure, e.rmse
        );
    }
    text + &format!(
        "\n  coverage of the measured values after the initial samples: {:.1} % by the 50 % band, {:.1} % by the 90 % band",
        100.0 * w.coverage50,
        100.0 * w.coverage90
    )
}
