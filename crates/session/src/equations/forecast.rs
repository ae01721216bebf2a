//! Free runs of an equation model from fitted initial states over whole records, and their errors.

use super::fit::prepare_records;
use augsim_equations::{EquationSystem, Model};
use augsim_fit::estimate_initial_state;
use augsim_system::{Offsets, Prepare, Record, Simulate, Simulated, Task};
use serde::Serialize;
use thiserror::Error;

/// Number of first samples of a recording to which the initial state of its free run is fitted, for figures and tables.
pub(crate) const BURN_IN: usize = 20;
/// Prediction horizons of the error table, s; the whole record is added.
const HORIZONS_S: [f64; 3] = [0.1, 0.5, 2.0];

/// A free run over one record: measured and predicted outputs at its samples.
#[derive(Debug)]
pub struct FreeRun {
    /// Times of the record's samples, s.
    pub times: Vec<f64>,
    /// Measured values of the outputs, `[output][sample]`.
    pub measured: Vec<Vec<f64>>,
    /// Predicted values of the outputs, `[output][sample]`.
    pub predicted: Vec<Vec<f64>>,
    /// Index of the first sample that was not used to fit the initial state.
    pub first: usize,
}

impl FreeRun {
    /// Errors of the outputs of `model`, measured minus predicted, `[output][sample]`; NaN before the first judged sample and
    /// where nothing was measured.
    pub fn errors(&self, model: &Model) -> Vec<Vec<f64>> {
        let error = |output: usize, k: usize| match k < self.first {
            true => f64::NAN,
            false => model.outputs[output].error(self.measured[output][k], self.predicted[output][k]),
        };
        let of_output = |output: usize| (0..self.times.len()).map(|k| error(output, k)).collect();
        (0..model.outputs.len()).map(of_output).collect()
    }
}

/// Prediction errors of an output over all records.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Name of the output.
    pub output: String,
    /// Root mean square error over all samples after the burn-in, in the unit of the output.
    pub rmse: f64,
    /// Unit of the output.
    pub unit: String,
    /// Errors up to several prediction horizons after the burn-in.
    pub horizons: Vec<Horizon>,
    /// Coefficient of determination R²: share of the output's variance that is explained.
    pub r2: f64,
    /// Number of samples after the burn-in that were compared.
    pub samples: usize,
}

/// Prediction error of an output up to a horizon.
#[derive(Debug, Serialize)]
pub struct Horizon {
    /// Prediction horizon: seconds after the burn-in.
    pub horizon_s: f64,
    /// Root mean square error up to this horizon, in the unit of the output.
    pub rmse: f64,
}

/// Simulates free runs of all records, with initial states fitted to the first `burn_in` samples.
///
/// # Errors
/// A record cannot be simulated.
pub fn free_runs(model: &Model, records: &[Record], burn_in: usize) -> anyhow::Result<Vec<FreeRun>> {
    let system = EquationSystem::declared_only(model)?.with_group_values();
    let records = prepare_records(&system, records)?;
    let system = system.tuned(&records)?;
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let mut runs = Vec::with_capacity(records.len());
    for record in &records {
        let start = initial_state(&system, model, record, &values, burn_in)?;
        let task = Task {
            parameters: &values,
            record,
            window: 0..record.times.len(),
            start: &start,
            offsets: Offsets::None,
            seeds: &[],
        };
        let mut out = Simulated::default();
        system.simulate(&task, &mut out)?;
        let read = |o: usize, k: usize| clip_to_sensor_range(&model.outputs[o], out.value(k, o));
        let outputs = 0..model.outputs.len();
        let predicted = outputs.map(|o| (0..out.samples()).map(|k| read(o, k)).collect()).collect();
        runs.push(FreeRun {
            times: record.times.clone(),
            measured: record.values.clone(),
            predicted,
            first: burn_in.min(record.times.len()),
        });
    }
    Ok(runs)
}

/// Fits the initial state to the first `burn_in` samples of a prepared record, at these values of the parameters.
///
/// # Errors
/// The record cannot be simulated.
pub(super) fn initial_state(
    system: &EquationSystem,
    model: &Model,
    record: &Record,
    values: &[f64],
    burn_in: usize,
) -> anyhow::Result<Vec<f64>> {
    let mut early = record.clone();
    // Later samples are removed first, since the initial guess of `prepare` must not use them either.
    early.values.iter_mut().for_each(|v| v.iter_mut().skip(burn_in.max(1)).for_each(|x| *x = f64::NAN));
    system.prepare(&mut early, &[])?;
    let from = early.windows.first().map(|w| w.start.clone()).unwrap_or_default();
    let sd: Vec<Option<f64>> = model.outputs.iter().map(|o| o.sd).collect();
    Ok(estimate_initial_state(system, &early, burn_in, values, &from, &sd)?.state)
}

/// Names the records without measured values after the first `burn_in` samples, which cannot be scored.
///
/// # Errors
/// All records lack such values, so that there is nothing to score.
pub fn unscored(records: &[Record], burn_in: usize, data: &str) -> anyhow::Result<Vec<String>> {
    let is_scored = |r: &&Record| r.values.iter().any(|v| v.iter().skip(burn_in).any(|v| v.is_finite()));
    let unscored: Vec<String> = records.iter().filter(|r| !is_scored(r)).map(|r| r.id.clone()).collect();
    if unscored.len() == records.len() {
        return Err(NothingToScore { data: data.to_owned(), burn_in }.into());
    }
    Ok(unscored)
}

/// Error: no trajectory has measured samples after those that the initial state is fitted to.
#[derive(Debug, Error)]
#[error(
    "{data}: no trajectory has measured samples after the first {burn_in}, which the initial state is fitted to, so there is nothing to score; use \
     longer trajectories, or a smaller --burn-in"
)]
pub struct NothingToScore {
    /// Name of the data in the message.
    pub data: String,
    /// Number of first samples that the initial state is fitted to.
    pub burn_in: usize,
}

/// Clips a value to the range of an output's sensor.
pub fn clip_to_sensor_range(output: &augsim_equations::model::Output, value: f64) -> f64 {
    match output.range {
        Some([low, high]) => value.clamp(low, high),
        None => value,
    }
}

/// Computes RMSE, errors by prediction horizon and R² of each output over free runs.
pub fn rows(model: &Model, runs: &[FreeRun]) -> Vec<Row> {
    let errors: Vec<_> = runs.iter().map(|run| run.errors(model)).collect();
    let row = |(index, output): (usize, &augsim_equations::model::Output)| {
        let squares_until = |horizon_s: f64| {
            let mut sum = 0.0;
            let mut count = 0_usize;
            for (run, errors) in runs.iter().zip(&errors) {
                let begin = run.times.get(run.first).copied().unwrap_or(f64::INFINITY);
                for (time, error) in run.times.iter().zip(&errors[index]) {
                    if error.is_finite() && time - begin <= horizon_s {
                        sum += error * error;
                        count += 1;
                    }
                }
            }
            (sum, count)
        };
        // NaN without a sample: no error is known then.
        let rmse = |(sum, count): (f64, usize)| (sum / count as f64).sqrt();
        let (sum, count) = squares_until(f64::INFINITY);
        let measured = || {
            let after_burn_in = |run: &FreeRun| run.measured[index][run.first..].to_vec();
            runs.iter().flat_map(after_burn_in).filter(|v| v.is_finite())
        };
        let mean = measured().sum::<f64>() / count.max(1) as f64;
        let variance: f64 = measured().map(|v| (v - mean) * (v - mean)).sum();
        let longest =
            runs.iter().filter_map(|r| Some(r.times.last()? - r.times.get(r.first)?)).fold(0.0, f64::max);
        // Horizons of fewer than four samples are left out: over these even a wrong model has a small error.
        let steps = runs.iter().filter_map(|r| Some(r.times.get(r.first + 1)? - r.times.get(r.first)?));
        let step = steps.fold(0.0, f64::max);
        let horizons = HORIZONS_S.into_iter().filter(|h| *h < longest && *h >= 4.0 * step);
        Row {
            output: output.name.clone(),
            rmse: rmse((sum, count)),
            unit: output.unit.map_or_else(String::new, |u| u.symbol()),
            horizons: horizons.map(|h| Horizon { horizon_s: h, rmse: rmse(squares_until(h)) }).collect(),
            r2: 1.0 - sum / variance,
            samples: count,
        }
    };
    model.outputs.iter().enumerate().map(row).collect()
}
