//! Predicts records by free runs of an equation model, with prediction bands.

use super::draws::{Bands, RecordDraws, prediction_set};
use super::parameter_uncertainty::ParameterUncertainty;
use super::process_noise::{ProcessNoise, next_value};
use crate::DataFrom;
use crate::equations::fit::prepare_records;
use crate::equations::forecast::clip_to_sensor_range;
use crate::equations::records;
use augsim_data::random_stream;
use augsim_discovery::{PredictOptions, PredictedRecord, PredictionSet};
use augsim_equations::model::{Output, SensorNoise};
use augsim_equations::{EquationSystem, Model};
use augsim_fit::{InitialStateEstimate, estimate_initial_state};
use augsim_system::{Offsets, Prepare, Record, Simulate, Simulated, Task};
use augsim_trainer::collect_in_order;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::ops::Range;

/// Memory for the draws of all records that are predicted at once, bytes: 400 draws of 300,000 samples.
const MAX_DRAW_BYTES: usize = 1 << 30;

/// Predicts all records by free runs, from initial states fitted to the first `burn_in` samples.
///
/// The bands come from draws. Each draw has parameters from their joint distribution, an initial state
/// refitted with these parameters to perturbed first samples, process noise if the model has it, and
/// measurement noise: as declared, as fitted, or else as estimated from the residual of the first samples.
///
/// # Errors
/// A column is missing, or a record cannot be simulated.
pub(super) fn predict(
    model: &Model,
    data: &DataFrom,
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<PredictionSet> {
    let measured = records::read(data, model)?;
    let mut list = records::records(&measured.data, model, false)?;
    list.retain(|record| options.is_requested(&record.id));
    let system = EquationSystem::declared_only(model)?.with_group_values();
    let list = prepare_records(&system, &list)?;
    let system = system.tuned(&list)?;
    let process_noise = ProcessNoise::for_system(&system)?;
    let uncertainty = ParameterUncertainty::new(model);
    let run =
        Prediction { model, system: &system, uncertainty, process_noise, burn_in: burn_in.max(1), options };
    let block_rows = block_rows(list.len(), options.draws, model.outputs.len());
    let rows = list.par_iter().enumerate();
    let bands = rows.map(|(i, record)| run.summarise(record, i as u64, block_rows));
    let (predicted, noise) = collect_in_order(bands)?.into_iter().unzip();
    Ok(prediction_set(model, predicted, noise, options.seed))
}

/// Number of samples of a record whose draws are in memory at once, within [`MAX_DRAW_BYTES`].
fn block_rows(records: usize, draws: usize, outputs: usize) -> usize {
    let concurrent = rayon::current_num_threads().min(records).max(1);
    let row_bytes = draws.max(1) * outputs.max(1) * size_of::<f64>();
    (MAX_DRAW_BYTES / concurrent / row_bytes).max(1)
}

/// Draws predictions of all records, which must be prepared.
///
/// # Errors
/// A record cannot be simulated.
pub(super) fn run_all(
    model: &Model,
    system: &EquationSystem,
    records: &[Record],
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<Vec<RecordDraws>> {
    let process_noise = ProcessNoise::for_system(system)?;
    let uncertainty = ParameterUncertainty::new(model);
    let run = Prediction { model, system, uncertainty, process_noise, burn_in: burn_in.max(1), options };
    collect_in_order(records.par_iter().enumerate().map(|(i, record)| run.predict(record, i as u64)))
}

/// The first samples of a record, and the initial state fitted to them.
pub(super) struct FittedInitialState {
    /// Number of first samples that the initial state was fitted to.
    pub known: usize,
    /// The record with all samples after the first `known` ones set to NaN.
    pub early_part: Record,
    /// The initial state that fits the first samples.
    pub initial_state: InitialStateEstimate,
    /// Measurement noise of each output: declared, fitted, or else estimated from the first samples.
    pub noise: Vec<SensorNoise>,
    /// Standard deviation of each output's noise that the model file states; `None` if it was estimated.
    pub known_sd: Vec<Option<f64>>,
}

impl FittedInitialState {
    /// Fits the initial state of a prepared record to its first `burn_in` samples.
    pub fn fit(
        model: &Model,
        system: &EquationSystem,
        record: &Record,
        burn_in: usize,
        values: &[f64],
    ) -> anyhow::Result<Self> {
        let outputs = model.outputs.len();
        let known = burn_in.min(record.times.len());
        let known_noise = known_noise(model);
        let known_sd: Vec<Option<f64>> = known_noise.iter().map(|n| n.map(|n| n.sd())).collect();
        let mut early = record.clone();
        // Later samples are removed first, since the initial guess of `prepare` must not use them either.
        early.values.iter_mut().for_each(|v| v.iter_mut().skip(known).for_each(|x| *x = f64::NAN));
        system.prepare(&mut early, &[])?;
        let from = early.windows.first().map(|w| w.start.clone()).unwrap_or_default();
        let initial_state = estimate_initial_state(system, &early, known, values, &from, &known_sd)?;
        // The estimate is corrected for the degrees of freedom that the initial state takes.
        let degrees_of_freedom = (known * outputs).saturating_sub(initial_state.state.len()).max(1) as f64;
        let widen = ((known * outputs) as f64 / degrees_of_freedom).sqrt();
        let estimated = |o: usize| SensorNoise::white(widen * initial_state.rmse[o]);
        let noise = (0..outputs).map(|o| known_noise[o].unwrap_or_else(|| estimated(o))).collect();
        Ok(FittedInitialState { known, early_part: early, initial_state, noise, known_sd })
    }
}

/// Measurement noise of each output from the model file: declared by the user, or else written by a fit.
fn known_noise(model: &Model) -> Vec<Option<SensorNoise>> {
    model.outputs.iter().map(|o| o.sd.map(SensorNoise::white).or(o.noise)).collect()
}

/// Draws the measurement errors, `[output][sample]`: white noise plus an Ornstein-Uhlenbeck process.
fn draw_errors(noise: &[SensorNoise], times: &[f64], normal: &mut dyn FnMut() -> f64) -> Vec<Vec<f64>> {
    let mut draw = |noise: &SensorNoise| {
        let mut correlated = noise.autocorrelated_sd * normal();
        let mut errors = Vec::with_capacity(times.len());
        for (k, time) in times.iter().enumerate() {
            if k > 0 && noise.autocorrelated_sd > 0.0 {
                let step_s = time - times[k - 1];
                let SensorNoise { autocorrelated_sd, correlation_time_s, .. } = *noise;
                correlated = next_value(correlated, autocorrelated_sd, correlation_time_s, step_s, normal);
            }
            errors.push(correlated + noise.white_sd * normal());
        }
        errors
    };
    noise.iter().map(&mut draw).collect()
}

/// A record with its fitted initial state and noise-free run.
struct Started {
    /// Nominal values of the parameters.
    values: Vec<f64>,
    fitted: FittedInitialState,
    /// Outputs of the run without noise, `[output][sample]`.
    forecast: Vec<Vec<f64>>,
}

/// Random quantities of one predictive draw.
struct Drawn {
    parameters: Vec<f64>,
    /// Measurement errors of the outputs, `[output][sample]`.
    errors: Vec<Vec<f64>>,
    /// Initial state fitted with the drawn parameters to perturbed first samples.
    state: Vec<f64>,
    /// The record with drawn process noise; `None` if the model has no process noise.
    record: Option<Record>,
}

/// Model and options shared by the predictions of all records.
struct Prediction<'a> {
    model: &'a Model,
    system: &'a EquationSystem,
    /// Joint distribution from which the parameters are drawn.
    uncertainty: ParameterUncertainty,
    /// Process noise of the model; `None` if it has none.
    process_noise: Option<ProcessNoise>,
    burn_in: usize,
    options: &'a PredictOptions,
}

impl Prediction<'_> {
    /// Fits the initial state of a record, and simulates the record without noise.
    fn start(&self, record: &Record) -> anyhow::Result<Started> {
        let values: Vec<f64> = self.system.parameters().iter().map(|p| p.nominal).collect();
        let fitted = FittedInitialState::fit(self.model, self.system, record, self.burn_in, &values)?;
        let state = &fitted.initial_state.state;
        let forecast = self.run(self.system, record, record.times.len(), &values, state)?;
        Ok(Started { values, fitted, forecast })
    }

    /// Draws all predictions of one record; `stream` is the number of its random stream.
    fn predict(&self, record: &Record, stream: u64) -> anyhow::Result<RecordDraws> {
        let started = self.start(record)?;
        let mut has_run = vec![true; self.options.draws];
        let draws = self.draw_rows(record, &started, stream, 0..record.times.len(), &mut has_run);
        let Started { fitted, forecast, .. } = started;
        let noise_sd = fitted.noise.iter().map(SensorNoise::sd).collect();
        Ok(RecordDraws::new(record, fitted.known, forecast, draws, noise_sd))
    }

    /// Summarises the draws of one record as bands, computed for at most `block_rows` samples at a time.
    ///
    /// Also returns the standard deviation of the measurement noise of each output.
    ///
    /// Each block repeats the simulations up to its end, so that the draws of all samples never have to be in
    /// memory at once.
    fn summarise(
        &self,
        record: &Record,
        stream: u64,
        block_rows: usize,
    ) -> anyhow::Result<(PredictedRecord, Vec<f64>)> {
        let started = self.start(record)?;
        let samples = record.times.len();
        let mut has_run = vec![true; self.options.draws];
        let mut blocks = Vec::new();
        // The last block comes first: it finds the draws that cannot be simulated to the end, which are left
        // out of all blocks.
        for first in (0..samples).step_by(block_rows).rev() {
            let rows = first..(first + block_rows).min(samples);
            let draws = self.draw_rows(record, &started, stream, rows, &mut has_run);
            blocks.push(draws.iter().map(|lists| Bands::of_draws(lists)).collect::<Vec<_>>());
        }
        blocks.reverse();
        let Started { fitted, forecast, .. } = started;
        let channel = |(o, output): (usize, &Output)| {
            let parts = blocks.iter().map(|block| &block[o]);
            Bands::joined(parts).channel(output, &record.values[o], &forecast[o])
        };
        let predicted = PredictedRecord {
            id: record.id.clone(),
            times: record.times.clone(),
            initial_sample_count: fitted.known,
            channels: self.model.outputs.iter().enumerate().map(channel).collect(),
        };
        Ok((predicted, fitted.noise.iter().map(SensorNoise::sd).collect()))
    }

    /// Draws the outputs at the samples `rows` of a record, sorted, `[output][sample][draw]`.
    ///
    /// Draws whose `has_run` is false are left out; a draw that cannot be simulated gets false.
    fn draw_rows(
        &self,
        record: &Record,
        started: &Started,
        stream: u64,
        rows: Range<usize>,
        has_run: &mut [bool],
    ) -> Vec<Vec<Vec<f64>>> {
        let mut rng = random_stream(self.options.seed, "foretell written", stream);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let outputs = self.model.outputs.len();
        let mut lists = vec![vec![Vec::with_capacity(self.options.draws); rows.len()]; outputs];
        // Random numbers are drawn in sequence, and the simulations of several draws run in parallel.
        for has_run in has_run.chunks_mut(rayon::current_num_threads().max(1)) {
            let batch: Vec<Option<Drawn>> =
                has_run.iter().map(|_| self.draw(record, started, &mut normal)).collect();
            let path = |(drawn, has_run): (&Option<Drawn>, &bool)| {
                let drawn = drawn.as_ref().filter(|_| *has_run)?;
                let (system, record) = match (&self.process_noise, &drawn.record) {
                    (Some(noise), Some(noisy)) => (&noise.system, noisy),
                    _ => (self.system, record),
                };
                self.run(system, record, rows.end, &drawn.parameters, &drawn.state).ok()
            };
            let paths: Vec<Option<Vec<Vec<f64>>>> = batch.par_iter().zip(&*has_run).map(path).collect();
            for ((drawn, path), has_run) in batch.iter().zip(&paths).zip(has_run) {
                let (Some(drawn), Some(path)) = (drawn, path) else {
                    *has_run = false;
                    continue;
                };
                for (o, lists) in lists.iter_mut().enumerate() {
                    for (k, list) in rows.clone().zip(lists) {
                        let noisy = path[o][k] + drawn.errors[o][k];
                        let value = clip_to_sensor_range(&self.model.outputs[o], noisy);
                        list.extend(Some(value).filter(|v| v.is_finite()));
                    }
                }
            }
        }
        lists.iter_mut().flatten().for_each(|list| list.sort_by(f64::total_cmp));
        lists
    }

    /// Draws parameters, measurement errors, initial state and process noise.
    ///
    /// `None` if no initial state can be fitted with the drawn parameters.
    fn draw(&self, record: &Record, started: &Started, normal: &mut dyn FnMut() -> f64) -> Option<Drawn> {
        let FittedInitialState { known, early_part, initial_state, noise, known_sd } = &started.fitted;
        let parameters = self.uncertainty.draw(self.system, record, &started.values, normal);
        // Subtracting drawn errors from the first samples gives the uncertainty of the initial state. The
        // same error path is added to the outputs, so that autocorrelated errors continue from the first
        // samples into the prediction.
        let errors = draw_errors(noise, &record.times, normal);
        let mut noisy = early_part.clone();
        for (values, errors) in noisy.values.iter_mut().zip(&errors) {
            values.iter_mut().zip(errors).for_each(|(v, e)| *v -= e);
        }
        let from = &initial_state.state;
        let start = estimate_initial_state(self.system, &noisy, *known, &parameters, from, known_sd).ok()?;
        let record = self.process_noise.as_ref().map(|noise| noise.draw_record(record, *known, normal));
        Some(Drawn { parameters, errors, state: start.state, record })
    }

    /// Simulates the first `samples` of a record, clipped to the sensor ranges, `[output][sample]`.
    fn run(
        &self,
        system: &EquationSystem,
        record: &Record,
        samples: usize,
        parameters: &[f64],
        start: &[f64],
    ) -> anyhow::Result<Vec<Vec<f64>>> {
        let path = free_run(system, record, samples, parameters, start)?;
        let read = |(output, values): (&Output, Vec<f64>)| -> Vec<f64> {
            values.into_iter().map(|v| clip_to_sensor_range(output, v)).collect()
        };
        Ok(self.model.outputs.iter().zip(path).map(read).collect())
    }
}

/// Simulates noise-free outputs, not clipped, at the first `samples` of a record, `[output][sample]`.
pub(super) fn free_run(
    system: &EquationSystem,
    record: &Record,
    samples: usize,
    parameters: &[f64],
    start: &[f64],
) -> anyhow::Result<Vec<Vec<f64>>> {
    let task = Task { parameters, record, window: 0..samples, start, offsets: Offsets::None, seeds: &[] };
    let mut out = Simulated::default();
    system.simulate(&task, &mut out)?;
    let outputs = 0..system.schema().channels.len();
    Ok(outputs.map(|o| (0..out.samples()).map(|k| out.value(k, o)).collect()).collect())
}

#[cfg(test)]
mod tests {
    //! Contract: the bands do not depend on the number of samples whose draws are in memory at once.
    use super::*;

    #[test]
    fn bands_are_the_same_by_blocks_of_any_length() {
        let text = "scenario = \"system\"\nname = \"decay\"\n[states]\nx_m = { start = \"pos_m\" }\n\
                    [parameters]\nk_per_s = { nominal = 1.0, min = 0.0, max = 10.0, ci95 = [0.8, 1.2] }\n\
                    [rates]\nx_m = \"-k_per_s * x_m\"\n[outputs]\npos_m = { value = \"x_m\", sd = 0.01 }\n";
        let model = augsim_equations::model::parse(text, "decay.toml").expect("a model");
        let times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
        let values = vec![times.iter().map(|t| (-t).exp()).collect()];
        let record = Record { id: "1".into(), times, values, ..Record::default() };
        let system = EquationSystem::declared_only(&model).expect("a system");
        let list = prepare_records(&system, &[record]).expect("prepared");
        let system = system.tuned(&list).expect("tuned");
        let options = PredictOptions { seed: 1, draws: 40, only: None };
        let uncertainty = ParameterUncertainty::new(&model);
        let run = Prediction {
            model: &model,
            system: &system,
            uncertainty,
            process_noise: None,
            burn_in: 5,
            options: &options,
        };
        let whole = run.summarise(&list[0], 0, 50).expect("bands");
        for block_rows in [1, 7, 49] {
            assert_eq!(run.summarise(&list[0], 0, block_rows).expect("bands"), whole, "{block_rows}");
        }
        let draws = run_all(&model, &system, &list, 5, &options).expect("draws");
        let at_end: f64 = draws[0].draws[0][49].iter().sum::<f64>() / 40.0;
        assert!((at_end - whole.0.channels[0].mean[49]).abs() < 1e-12);
        assert_eq!(block_rows(1, 400, 1), 335_544);
    }
}
