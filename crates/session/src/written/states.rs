//! States of measured records of a system of equations, as nets learn from them: a net corrects the rates of the states, and sensors
//! show outputs.

use super::fit::prepared;
use super::noise::smoothed;
use super::records::records;
use augsim_calibrate::fit_start;
use augsim_data::Dataset;
use augsim_physics::system::{Record, System};
use augsim_trainer::{Engine, Sequence, Sequences, WrittenEngine};
use augsim_written::WrittenSystem;
use augsim_written::engine::Signal;
use augsim_written::model::{Hold, Model};
use rayon::prelude::*;
use thiserror::Error;

/// Deviation of one step of a clock from the mean of all, in that, up to which times are taken for rounded.
const ROUNDED: f64 = 0.02;

/// Samples of a short window beyond two for each state.
const SAMPLES: usize = 8;
/// Short windows that are looked at, at most.
const WINDOWS: usize = 200;
/// Share of the misfit over short windows below which the smoother's noise of a sensor is not believed.
const LEAST: f64 = 0.02;

/// Records whose samples have no regular clock.
#[derive(Debug, Error)]
pub enum Clock {
    /// A step of another length.
    #[error(
        "trajectory `{id}`: {found} s from the sample at {at} s to the next, but {step_s} s elsewhere; nets of equations learn steps of \
         one length: bring the data onto a regular clock with an output in every row"
    )]
    Irregular {
        /// Trajectory.
        id: String,
        /// Time of the sample, s.
        at: f64,
        /// Seconds to the next one.
        found: f64,
        /// Seconds of a step elsewhere.
        step_s: f64,
    },
    /// Another clock than that of the training data.
    #[error(
        "trajectory `{id}`: samples every {found} s, but the net was trained on steps of {step_s} s; resample the data"
    )]
    Other {
        /// Trajectory.
        id: String,
        /// Seconds of its steps.
        found: f64,
        /// Seconds of the steps of the training data.
        step_s: f64,
    },
    /// No trajectory has two samples.
    #[error("no trajectory has two samples; nets learn steps")]
    None,
}

/// Seconds between the samples of all records.
///
/// # Errors
/// The clock is not regular.
pub fn step_s(records: &[Record]) -> Result<f64, Clock> {
    let mean = |r: &Record| {
        let (first, last) = (r.times.first()?, r.times.last()?);
        (r.times.len() > 1).then(|| (last - first) / (r.times.len() - 1) as f64)
    };
    let step_s = records.iter().find_map(mean).ok_or(Clock::None)?;
    // Times are decimal numbers: to a picosecond the mean is what was meant.
    let step_s = (step_s * 1e12).round() / 1e12;
    check_clock(records, step_s, |id, at, found| Clock::Irregular { id, at, found, step_s })?;
    Ok(step_s)
}

/// Checks that records have the steps that an engine was trained on.
///
/// # Errors
/// They have not.
pub fn check_clock_of(engine: &WrittenEngine, records: &[Record]) -> Result<(), Clock> {
    let step_s = engine.step_s();
    check_clock(records, step_s, |id, _, found| Clock::Other { id, found, step_s })
}

/// Checks that records have this step; `fault` takes a trajectory, the time of a sample, s, and the seconds to the next.
fn check_clock(
    records: &[Record],
    step_s: f64,
    fault: impl Fn(String, f64, f64) -> Clock,
) -> Result<(), Clock> {
    for record in records {
        let steps = record.times.windows(2).map(|w| (w[0], w[1] - w[0]));
        let off = |(_, step): &(f64, f64)| (step - step_s).abs() > ROUNDED * step_s;
        if let Some((at, found)) = steps.clone().find(off) {
            return Err(fault(record.id.clone(), at, (found * 1e9).round() / 1e9));
        }
    }
    Ok(())
}

/// The engine of a model for these records, which are not prepared.
///
/// # Errors
/// The clock is not regular, or the model cannot be simulated over the records.
pub fn engine(model: &Model, records: &[Record]) -> anyhow::Result<Engine> {
    let step_s = step_s(records)?;
    let system = WrittenSystem::declared_only(model)?;
    let ready = prepared(&system, records)?;
    let system = system.tuned(&ready)?;
    let sensor_sd = sensor_sd(model, &system, records)?;
    Ok(Engine::Written(WrittenEngine::new(&system, step_s, sensor_sd)?))
}

/// Standard deviation of the sensor of each output, in its unit: as the model declares it, or else as the smoother tells it from what moves,
/// and that of misfits over short windows where the smoother finds next to none. A motion that is pushed anew at every sample explains every reading of
/// a sensor without noise; a net that learned from such states would learn the noise (on Silverbox the smoother alone says 1e-14 V, and
/// the net made the free run seven times worse).
fn sensor_sd(model: &Model, system: &WrittenSystem, records: &[Record]) -> anyhow::Result<Vec<f64>> {
    let known: Option<Vec<f64>> = model.outputs.iter().map(|output| output.sd).collect();
    if let Some(known) = known {
        return Ok(known);
    }
    let (found, short) = (smoothed(model, records)?.sensor_sd, short_misfits(model, system, records)?);
    let each = model.outputs.iter().zip(found.into_iter().zip(short));
    Ok(each
        .map(|(output, (found, short))| {
            output.sd.unwrap_or(if found < LEAST * short { short } else { found })
        })
        .collect())
}

/// Root mean square misfit of each output over short windows from starts that are fitted to them, spread over the records; corrected for
/// what the starts take.
fn short_misfits(model: &Model, system: &WrittenSystem, records: &[Record]) -> anyhow::Result<Vec<f64>> {
    let (outputs, values) = (model.outputs.len(), model.nominals());
    let length = SAMPLES + 2 * model.states.len();
    let places: Vec<(&Record, usize)> = records
        .iter()
        .flat_map(|r| {
            (0..(r.times.len() + 1).saturating_sub(length)).step_by(length).map(move |first| (r, first))
        })
        .collect();
    let stride = places.len().div_ceil(WINDOWS).max(1);
    let one = |(record, first): (&Record, usize)| -> Option<Vec<f64>> {
        let samples = first..first + length;
        let mut part = Record { times: record.times[samples.clone()].to_vec(), ..record.clone() };
        part.values.iter_mut().for_each(|v| *v = v[samples.clone()].to_vec());
        system.prepare(&mut part, &[]).ok()?;
        let from = part.windows.first()?.start.clone();
        let declared = vec![None; outputs];
        let begun = fit_start(system, &part, length, &values, &from, &declared).ok()?;
        let seen = (length * outputs) as f64;
        let widen = seen / (seen - begun.state.len() as f64).max(1.0);
        Some(begun.rms.into_iter().map(|rms| widen * rms * rms).collect())
    };
    let chosen: Vec<(&Record, usize)> = places.into_iter().step_by(stride).collect();
    let squares: Vec<Vec<f64>> = chosen.into_par_iter().filter_map(one).collect();
    let median = |o: usize| {
        let mut list: Vec<f64> = squares.iter().map(|s| s[o]).filter(|v| v.is_finite()).collect();
        list.sort_by(f64::total_cmp);
        list.get(list.len() / 2).map_or(0.0, |square| square.sqrt())
    };
    Ok((0..outputs).map(median).collect())
}

/// Notes for people about what of a model's inputs a net takes in another way.
pub fn notes(model: &Model) -> Vec<String> {
    let mut notes = Vec::new();
    for input in &model.inputs {
        let name = &input.name;
        if input.hold.is_none() {
            notes.push(format!(
                "{name}: the model says nothing of how it runs between samples (hold), and it is taken for straight; `augsim fit` finds \
                 it from data"
            ));
        }
        if input.delay.is_some() {
            notes.push(format!("{name}: the net reads the delayed signal at the samples"));
        }
    }
    notes
}

/// Estimated states of measured trajectories with the inputs at their samples.
///
/// # Errors
/// The clock is another than the engine's, or the model cannot be simulated over the records.
pub fn sequences(data: &Dataset, engine: &WrittenEngine) -> anyhow::Result<Sequences> {
    let model = engine.equations();
    let records = records(data, model, true)?;
    let columns = model.states.iter().map(|s| s.name.clone()).collect();
    let action_columns = engine.action_columns().to_vec();
    check_clock_of(engine, &records)?;
    // The sensors have the noise that the engine was made with.
    let mut known = model.clone();
    known
        .outputs
        .iter_mut()
        .zip(engine.sensor_sd())
        .for_each(|(output, sd)| output.sd = Some(*sd).filter(|sd| *sd > 0.0));
    let paths = smoothed(&known, &records)?.paths;
    let items =
        records.iter().zip(paths).filter(|(record, _)| record.times.len() > 1).map(|(record, states)| {
            Sequence {
                id: record.id.clone(),
                time: record.times.len(),
                states,
                actions: actions(model, record),
            }
        });
    Ok(Sequences { columns, action_columns, items: items.collect() })
}

/// Inputs of a record, which is not prepared, at its samples, those with a delay delayed, then the second derivatives of those that run as
/// splines, and the times: the engine's actions, `[sample, A]`.
pub fn actions(model: &Model, record: &Record) -> Vec<f64> {
    let nominals = model.nominals();
    let signals: Vec<(Signal, f64)> = (model.inputs.iter().zip(record.inputs.iter()))
        .map(|(input, stream)| {
            let values = stream.values.first().map_or(&[][..], Vec::as_slice);
            let hold = input.hold.unwrap_or(Hold::Linear);
            (Signal::new(&stream.times, values, hold), input.delay.map_or(0.0, |d| nominals[d]))
        })
        .collect();
    let row = |t: &f64| -> Vec<f64> {
        let values = signals.iter().map(|(signal, delay)| signal.at(t - delay));
        let splines = signals.iter().filter(|(signal, _)| signal.hold() == Hold::Spline);
        values.chain(splines.map(|(signal, delay)| signal.curvature_at(t - delay))).chain([*t]).collect()
    };
    record.times.iter().flat_map(row).collect()
}
