//! Estimates process noise and measurement noise of a calibrated model, and the smoothed states.

use super::fit::prepare_records;
use augsim_discovery::{NoiseCause, NoiseRow, NoiseSource};
use augsim_equations::model::{RateNoise, SensorNoise};
use augsim_equations::{EquationSystem, Model};
use augsim_fit::{Cause, Smoothed, smooth};
use augsim_system::{Record, Simulate};

/// Maximum total number of samples from which the noise of a model is estimated.
const MAX_SAMPLES: usize = 6_000;

/// Estimates states at every sample with a smoother, and the noise that best explains the records.
///
/// The states at a sample also use later samples, so they are not predictions.
///
/// # Errors
/// The model cannot be compiled, there are no measurements, or a record cannot be simulated.
pub fn smoothed(model: &Model, records: &[Record]) -> anyhow::Result<Smoothed> {
    let system = EquationSystem::declared_only(model)?.with_group_values();
    let records = prepare_records(&system, records)?;
    let system = system.tuned(&records)?;
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let declared: Vec<Option<f64>> = model.outputs.iter().map(|output| output.sd).collect();
    let (with_state_outputs, noisy_states) =
        (system.with_states_as_channels()?, system.process_noise_states());
    Ok(smooth(&with_state_outputs, model.outputs.len(), &records, &values, &noisy_states, &declared)?)
}

/// Estimates process noise and measurement noise, and writes them into the model.
///
/// Prediction bands use both.
///
/// # Errors
/// As [`smoothed`].
pub fn find(model: &mut Model, records: &[Record]) -> anyhow::Result<NoiseCause> {
    let found = smoothed(model, &first_samples(records))?;
    let noisy_states = EquationSystem::declared_only(model)?.process_noise_states();
    model.states.iter_mut().for_each(|state| state.process_noise = None);
    if found.cause == Cause::ProcessNoise {
        for (state, sd) in noisy_states.iter().zip(&found.disturbance_sd) {
            model.states[*state].process_noise =
                Some(RateNoise { sd: *sd, correlation_time_s: found.correlation_time_s });
        }
    }
    let autocorrelated = found.cause == Cause::AutocorrelatedSensor;
    for (o, output) in model.outputs.iter_mut().enumerate() {
        let white = SensorNoise::white(found.sensor_sd[o]);
        output.noise = Some(match autocorrelated {
            true => SensorNoise {
                autocorrelated_sd: found.disturbance_sd[o],
                correlation_time_s: found.correlation_time_s,
                ..white
            },
            false => white,
        });
    }
    Ok(noise_result(model, &noisy_states, &found))
}

/// Converts the estimated noise to the format of a result.
fn noise_result(model: &Model, noisy_states: &[usize], found: &Smoothed) -> NoiseCause {
    let symbol = |unit: Option<augsim_data::Unit>| unit.map_or_else(String::new, |u| u.symbol());
    let outputs = || model.outputs.iter().map(|o| (o.name.clone(), symbol(o.unit)));
    let row = |((name, unit), sd): ((String, String), &f64)| NoiseRow { name, sd: *sd, unit };
    let rate = |state: &usize| {
        let state = &model.states[*state];
        let unit = state.unit.map(|unit| unit.dimensions() / augsim_data::Dimensions::TIME);
        (
            state.name.clone(),
            unit.and_then(augsim_data::Unit::from_dimensions).map_or_else(String::new, |u| u.symbol()),
        )
    };
    let (by, lasting) = match found.cause {
        Cause::Sensor => (NoiseSource::Sensor, Vec::new()),
        Cause::AutocorrelatedSensor => {
            (NoiseSource::AutocorrelatedSensor, outputs().zip(&found.disturbance_sd).map(row).collect())
        }
        Cause::ProcessNoise => (
            NoiseSource::ProcessNoise,
            noisy_states.iter().map(rate).zip(&found.disturbance_sd).map(row).collect(),
        ),
    };
    NoiseCause {
        source: by,
        disturbances: lasting,
        correlation_time_s: found.correlation_time_s,
        white_noise: outputs().zip(&found.sensor_sd).map(row).collect(),
    }
}

/// Cuts records to the first [`MAX_SAMPLES`] samples in total.
fn first_samples(records: &[Record]) -> Vec<Record> {
    let mut remaining = MAX_SAMPLES;
    let mut parts = Vec::new();
    for record in records.iter().filter(|r| r.times.len() > 1) {
        let samples = record.times.len().min(remaining);
        if samples < 2 {
            break;
        }
        remaining -= samples;
        let mut part = record.clone();
        part.times.truncate(samples);
        part.values.iter_mut().for_each(|values| values.truncate(samples));
        parts.push(part);
    }
    parts
}
