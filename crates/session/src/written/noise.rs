//! Noise by which records differ from runs of a model whose parameters are known, and states under it.

use super::fit::prepared;
use augsim_calibrate::{Cause, Smoothed, smooth};
use augsim_discovery::{NoiseCause, NoiseRow, ShakenBy};
use augsim_physics::system::{Record, System};
use augsim_written::model::{SensorNoise, Shaken};
use augsim_written::{Model, WrittenSystem};

/// Samples that the noise of a model is found on, at most.
const MOST_SAMPLES: usize = 6_000;

/// States of records at every sample, and the noise by which the records differ from runs of the model. Readings of later samples are
/// used as well: states are estimates of the past, no forecasts.
///
/// # Errors
/// The model cannot be compiled, nothing was measured, or a record cannot be simulated.
pub fn smoothed(model: &Model, records: &[Record]) -> anyhow::Result<Smoothed> {
    let system = WrittenSystem::declared_only(model)?;
    let records = prepared(&system, records)?;
    let system = system.tuned(&records)?;
    let values: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
    let declared: Vec<Option<f64>> = model.outputs.iter().map(|output| output.sd).collect();
    let (shown, pushed) = (system.showing_states()?, system.pushed_states());
    Ok(smooth(&shown, model.outputs.len(), &records, &values, &pushed, &declared)?)
}

/// Estimates the noise by which records differ from runs of a model, and writes it into the model: process noise to the states, measurement
/// noise to the outputs. Forecasts draw their bands with both.
///
/// # Errors
/// As [`smoothed`].
pub fn find(model: &mut Model, records: &[Record]) -> anyhow::Result<NoiseCause> {
    let found = smoothed(model, &beginnings(records))?;
    let pushed = WrittenSystem::declared_only(model)?.pushed_states();
    model.states.iter_mut().for_each(|state| state.shaken = None);
    if found.cause == Cause::Motion {
        for (state, sd) in pushed.iter().zip(&found.drive_sd) {
            model.states[*state].shaken = Some(Shaken { sd: *sd, memory_s: found.memory_s });
        }
    }
    let autocorrelated = found.cause == Cause::LastingSensor;
    for (o, output) in model.outputs.iter_mut().enumerate() {
        let white = SensorNoise::white(found.sensor_sd[o]);
        output.noise = Some(match autocorrelated {
            true => SensorNoise {
                autocorrelated_sd: found.drive_sd[o],
                correlation_time_s: found.memory_s,
                ..white
            },
            false => white,
        });
    }
    Ok(told(model, &pushed, &found))
}

/// The noise that was found in the words of a result.
fn told(model: &Model, pushed: &[usize], found: &Smoothed) -> NoiseCause {
    let symbol = |unit: Option<augsim_data::Unit>| unit.map_or_else(String::new, |u| u.symbol());
    let outputs = || model.outputs.iter().map(|o| (o.name.clone(), symbol(o.unit)));
    let row = |((name, unit), sd): ((String, String), &f64)| NoiseRow { name, sd: *sd, unit };
    let rate = |state: &usize| {
        let state = &model.states[*state];
        let unit = state.unit.map(|unit| unit.dimensions() / augsim_data::Dimensions::TIME);
        (
            state.name.clone(),
            unit.and_then(augsim_data::Unit::of_dimensions).map_or_else(String::new, |u| u.symbol()),
        )
    };
    let (by, lasting) = match found.cause {
        Cause::Sensor => (ShakenBy::Sensor, Vec::new()),
        Cause::LastingSensor => (ShakenBy::LastingSensor, outputs().zip(&found.drive_sd).map(row).collect()),
        Cause::Motion => (ShakenBy::Motion, pushed.iter().map(rate).zip(&found.drive_sd).map(row).collect()),
    };
    NoiseCause {
        by,
        lasting,
        memory_s: found.memory_s,
        readings: outputs().zip(&found.sensor_sd).map(row).collect(),
    }
}

/// The first samples of records, not too many of them together.
fn beginnings(records: &[Record]) -> Vec<Record> {
    let mut left = MOST_SAMPLES;
    let mut begun = Vec::new();
    for record in records.iter().filter(|r| r.times.len() > 1) {
        let samples = record.times.len().min(left);
        if samples < 2 {
            break;
        }
        left -= samples;
        let mut part = record.clone();
        part.times.truncate(samples);
        part.values.iter_mut().for_each(|values| values.truncate(samples));
        begun.push(part);
    }
    begun
}
