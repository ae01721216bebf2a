//! `augsim predict MODEL`: forecasts of a model file.

use crate::args::Predict;
use crate::commands::note_reading;
use crate::commands::own_data::OwnData;
use augsim_data::{estimate_digits, write_dataset};
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_session::Subject;
use augsim_session::predict::{self, table};
use augsim_terminal::Outcome;
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    forecast: PathBuf,
    trajectories: usize,
    samples: usize,
    /// Description of the samples from which the initial states were estimated.
    start: String,
    errors: Vec<Error>,
    /// Whether the model was fitted to the predicted data, or to a part of them.
    fitted: bool,
    /// Share, 0 to 1, of the measured values after the initial samples in the 50 % band; absent without such values.
    coverage50: Option<f64>,
    coverage90: Option<f64>,
}

#[derive(Serialize)]
struct Error {
    measure: String,
    rmse: f64,
    ci95: [f64; 2],
    unit: String,
    /// Share, 0 to 1, of the measured values of this measure in the 50 % prediction band.
    coverage50: f64,
    coverage90: f64,
}

/// Forecasts the data with the model in `file` and writes the prediction bands.
pub(super) fn run(args: &Predict, file: &Path, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    data_file(&args.out, &[], &args.inputs([file]))?;
    let model = Subject::read(file)?;
    let draws = args.samples.map_or(predict::DRAWS, |n| n as usize);
    let options = PredictOptions { seed, draws, only: None };
    let data = args.measured();
    let steps = Steps::new(output);
    steps.show_step(format!("forecasting with {draws} draws of each trajectory"));
    let all = predict::predict(&model, &data, args.burn_in as usize, &options)?;
    steps.finish();
    if let Subject::Equations(model) = &model {
        note_reading(&data, model, output)?;
    }
    let own_data = OwnData::find(file, &args.data);
    write_predictions(args, &all, draws, own_data.is_some(), output)?;
    if let Some(own_data) = own_data {
        output.note(own_data.sentence("predict"));
    }
    Ok(Outcome::Done)
}

/// Writes the prediction bands of all trajectories and prints the errors.
pub(super) fn write_predictions(
    args: &Predict,
    all: &PredictionSet,
    draws: usize,
    fitted: bool,
    output: &Output,
) -> anyhow::Result<Outcome> {
    write_dataset(&table::bands(all)?, &args.out)?;
    let written = summary(args, all, draws, fitted);
    output.result(&written, || forecast_text(&written))?;
    Ok(Outcome::Done)
}

fn summary(args: &Predict, all: &PredictionSet, draws: usize, fitted: bool) -> Written {
    let measured = all.errors.iter().filter(|e| e.rmse.is_finite());
    let errors = measured.map(|e| Error {
        measure: e.measure.clone(),
        rmse: e.rmse,
        ci95: e.ci95,
        unit: e.unit.clone(),
        coverage50: all.coverage(0.5, &e.channels).0,
        coverage90: all.coverage(0.9, &e.channels).0,
    });
    let has_samples = all.total_coverage(0.5).1 > 0;
    Written {
        forecast: args.out.clone(),
        trajectories: all.records.len(),
        samples: draws,
        start: all.start.clone(),
        errors: errors.collect(),
        fitted,
        coverage50: has_samples.then(|| all.total_coverage(0.5).0),
        coverage90: has_samples.then(|| all.total_coverage(0.9).0),
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
        let [rmse, low, high] = estimate_digits(e.rmse, e.ci95);
        text += &format!(
            "\n  {}: root mean square error {rmse}{unit} (95 % interval {low} to {high}); {:.1} % of its measured values in the 50 % band, {:.1} % in the 90 % band",
            e.measure,
            100.0 * e.coverage50,
            100.0 * e.coverage90
        );
    }
    let (Some(coverage50), Some(coverage90)) = (w.coverage50, w.coverage90) else {
        return text + "\n  nothing was measured after the initial samples, so there is no error";
    };
    text + &format!(
        "\n  coverage of the measured values after the initial samples: {:.1} % by the 50 % band, {:.1} % by the 90 % band",
        100.0 * coverage50,
        100.0 * coverage90
    )
}
