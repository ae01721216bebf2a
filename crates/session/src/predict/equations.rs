//! Free runs of an equation model with prediction bands.

use super::draws::{RecordDraws, prediction_set};
use super::parameter_uncertainty::ParameterUncertainty;
use super::process_noise::{ProcessNoise, next_value};
use crate::DataFrom;
use crate::equations::fit::prepare_records;
use crate::equations::forecast::clip_to_sensor_range;
use crate::equations::records;
use augsim_data::random_stream;
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_equations::model::{Output, SensorNoise};
use augsim_equations::{EquationSystem, Model};
use augsim_fit::{InitialStateEstimate, estimate_initial_state};
use augsim_physics::system::{Offsets, Record, Simulated, System, Task};
use augsim_trainer::collect_in_order;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Free runs of all records, from initial states fitted to the first `burn_in` samples.
///
/// The bands come from draws. Each draw has parameters from their joint distribution, an initial state
/// refitted with these to perturbed first samples, process noise if the model has it, and measurement noise:
/// as declared, as fitted, or else as estimated from the residual of the first samples.
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
    let system = EquationSystem::declared_only(model)?;
    let list = prepare_records(&system, &list)?;
    let system = system.tuned(&list)?;
    let drawn = run_all(model, &system, &list, burn_in, options)?;
    Ok(prediction_set(model, &drawn, options.seed))
}

/// Draws of all records, which must be prepared.
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
    /// Number of first samples.
    pub known: usize,
    /// The record with all later samples set to NaN.
    pub early_part: Record,
    /// The fitted initial state.
    pub initial_state: InitialStateEstimate,
    /// Measurement noise of each output: declared, fitted, or else estimated from the first samples.
    pub noise: Vec<SensorNoise>,
    /// Standard deviation of the noise of each output that the model file states; `None` if it was estimated.
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

/// Model and options shared by the predictions of all records.
struct Prediction<'a> {
    model: &'a Model,
    system: &'a EquationSystem,
    /// Uncertainty of the parameters.
    uncertainty: ParameterUncertainty,
    /// Process noise, if the model has any.
    process_noise: Option<ProcessNoise>,
    burn_in: usize,
    options: &'a PredictOptions,
}

impl Prediction<'_> {
    /// Predicts one record; `stream` is the number of its random stream.
    fn predict(&self, record: &Record, stream: u64) -> anyhow::Result<RecordDraws> {
        let outputs = self.model.outputs.len();
        let values: Vec<f64> = self.system.parameters().iter().map(|p| p.nominal).collect();
        let FittedInitialState { known, early_part: early, initial_state: begun, noise, known_sd } =
            FittedInitialState::fit(self.model, self.system, record, self.burn_in, &values)?;
        let forecast = self.run(self.system, record, &values, &begun.state)?;
        let mut rng = random_stream(self.options.seed, "foretell written", stream);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let samples = record.times.len();
        let mut draws = vec![vec![Vec::with_capacity(self.options.draws); samples]; outputs];
        for _ in 0..self.options.draws {
            let parameters = self.uncertainty.draw(self.system, &values, &mut normal);
            // Subtracting drawn errors from the first samples gives the uncertainty of the initial state. The
            // same error path is added to the outputs below, so that autocorrelated errors continue from the
            // first samples into the prediction.
            let errors = draw_errors(&noise, &record.times, &mut normal);
            let mut noisy = early.clone();
            for (values, errors) in noisy.values.iter_mut().zip(&errors) {
                values.iter_mut().zip(errors).for_each(|(v, e)| *v -= e);
            }
            // Draws whose parameters are so far off that the model cannot be simulated are dropped.
            let Ok(start) =
                estimate_initial_state(self.system, &noisy, known, &parameters, &begun.state, &known_sd)
            else {
                continue;
            };
            let path = match &self.process_noise {
                Some(noise) => {
                    let noisy_record = noise.draw_record(record, known, &mut normal);
                    self.run(&noise.system, &noisy_record, &parameters, &start.state)
                }
                None => self.run(self.system, record, &parameters, &start.state),
            };
            let Ok(path) = path else { continue };
            for (o, (values, list)) in path.iter().zip(&mut draws).enumerate() {
                for ((v, e), list) in values.iter().zip(&errors[o]).zip(list) {
                    let value = clip_to_sensor_range(&self.model.outputs[o], v + e);
                    list.extend(Some(value).filter(|v| v.is_finite()));
                }
            }
        }
        let noise_sd = noise.iter().map(SensorNoise::sd).collect();
        Ok(RecordDraws::new(record, known, forecast, draws, noise_sd))
    }

    /// A free run of a record, clipped to the ranges of the sensors, `[output][sample]`.
    fn run(
        &self,
        system: &EquationSystem,
        record: &Record,
        parameters: &[f64],
        start: &[f64],
    ) -> anyhow::Result<Vec<Vec<f64>>> {
        let path = free_run(system, record, record.times.len(), parameters, start)?;
        let read = |(output, values): (&Output, Vec<f64>)| -> Vec<f64> {
            values.into_iter().map(|v| clip_to_sensor_range(output, v)).collect()
        };
        Ok(self.model.outputs.iter().zip(path).map(read).collect())
    }
}

/// Noise-free outputs, not clipped, of the first `samples` of a record, `[output][sample]`.
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
