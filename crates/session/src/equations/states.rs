//! Estimated states of measured records as training data for nets, which correct the rates of the states.

use super::fit::prepare_records;
use super::noise::smoothed;
use super::records::records;
use augsim_data::Dataset;
use augsim_equations::EquationSystem;
use augsim_equations::engine::Signal;
use augsim_equations::model::{Hold, Model};
use augsim_fit::estimate_initial_state;
use augsim_system::{Prepare, Record};
use augsim_trainer::{Engine, EquationEngine, Sequence, Sequences};
use rayon::prelude::*;
use thiserror::Error;

/// Relative deviation of a sampling step from the mean that is accepted as rounding of the times.
const STEP_TOLERANCE: f64 = 0.02;
/// Number of samples of a short window in addition to two for each state.
const EXTRA_SAMPLES: usize = 8;
/// Maximum number of short windows to which initial states are fitted.
const MAX_WINDOWS: usize = 200;
/// Smallest accepted ratio of the smoother's measurement noise to the residual over short windows.
///
/// Below it the smoother's estimate is not used.
const MIN_NOISE_RATIO: f64 = 0.02;

/// Error: records whose sampling does not suit a net.
#[derive(Debug, Error)]
pub enum ClockError {
    /// The sampling step of a trajectory is not constant.
    #[error(
        "trajectory `{id}`: the step at {at} s is {found} s, but the other steps are {step_s} s; nets need a constant sampling step: \
         resample the data so that every row has an output"
    )]
    Irregular {
        /// Name of the trajectory with the deviating step.
        id: String,
        /// Time of the sample before the deviating step, s.
        at: f64,
        /// Length of the deviating step, s.
        found: f64,
        /// Length of the other steps, s.
        step_s: f64,
    },
    /// The sampling step of a trajectory differs from that of the training data.
    #[error(
        "trajectory `{id}`: samples every {found} s, but the net was trained on steps of {step_s} s; resample the data"
    )]
    Other {
        /// Name of the trajectory with the other sampling step.
        id: String,
        /// Sampling step of the trajectory, s.
        found: f64,
        /// Sampling step of the training data, s.
        step_s: f64,
    },
    /// No trajectory has two samples, so there is no sampling step.
    #[error("no trajectory has two samples; a net is trained on steps from sample to sample")]
    None,
}

/// Determines the constant sampling step of all records, s.
///
/// # Errors
/// The sampling step is not constant.
pub fn step_s(records: &[Record]) -> Result<f64, ClockError> {
    let mean = |r: &Record| {
        let (first, last) = (r.times.first()?, r.times.last()?);
        (r.times.len() > 1).then(|| (last - first) / (r.times.len() - 1) as f64)
    };
    let step_s = records.iter().find_map(mean).ok_or(ClockError::None)?;
    // Times in files are rounded decimals; rounding the mean to a picosecond restores the intended step.
    let step_s = (step_s * 1e12).round() / 1e12;
    check_clock(records, step_s, |id, at, found| ClockError::Irregular { id, at, found, step_s })?;
    Ok(step_s)
}

/// Checks that records have the sampling step of an engine.
///
/// # Errors
/// A record has another sampling step.
pub fn check_step_of_engine(engine: &EquationEngine, records: &[Record]) -> Result<(), ClockError> {
    let step_s = engine.step_s();
    check_clock(records, step_s, |id, _, found| ClockError::Other { id, found, step_s })
}

/// Checks that all steps of the records are `step_s` within rounding.
///
/// `fault` makes the error from the trajectory, the time of the sample, s, and the step found there, s.
fn check_clock(
    records: &[Record],
    step_s: f64,
    fault: impl Fn(String, f64, f64) -> ClockError,
) -> Result<(), ClockError> {
    for record in records {
        let steps = record.times.windows(2).map(|w| (w[0], w[1] - w[0]));
        let deviates = |(_, step): &(f64, f64)| (step - step_s).abs() > STEP_TOLERANCE * step_s;
        if let Some((at, found)) = steps.clone().find(deviates) {
            return Err(fault(record.id.clone(), at, (found * 1e9).round() / 1e9));
        }
    }
    Ok(())
}

/// Builds the engine that a net corrects, from a model and records that need not be prepared.
///
/// # Errors
/// The sampling step is not constant, or the model cannot be simulated over the records.
pub fn engine(model: &Model, records: &[Record]) -> anyhow::Result<Engine> {
    let step_s = step_s(records)?;
    let system = EquationSystem::declared_only(model)?.with_group_values();
    let ready = prepare_records(&system, records)?;
    let system = system.tuned(&ready)?;
    let sensor_sd = sensor_sd(model, &system, records)?;
    Ok(Engine::Equations(EquationEngine::new(&system, step_s, sensor_sd)?))
}

/// Determines the standard deviation of the measurement noise of each output, in the unit of the output.
///
/// As declared, or else as estimated by the smoother; where the smoother finds almost none, the RMS residual
/// over short windows. White process noise can explain every reading without measurement noise, and a net
/// trained on such states would learn the noise: on Silverbox the smoother alone gives 1e-14 V, and the net
/// made the free run seven times worse.
fn sensor_sd(model: &Model, system: &EquationSystem, records: &[Record]) -> anyhow::Result<Vec<f64>> {
    let known: Option<Vec<f64>> = model.outputs.iter().map(|output| output.sd).collect();
    if let Some(known) = known {
        return Ok(known);
    }
    let (found, short) =
        (smoothed(model, records)?.sensor_sd, short_window_residuals(model, system, records)?);
    let outputs = model.outputs.iter().zip(found.into_iter().zip(short));
    Ok(outputs
        .map(|(output, (found, short))| {
            output.sd.unwrap_or(if found < MIN_NOISE_RATIO * short { short } else { found })
        })
        .collect())
}

/// Median RMS residual of each output over short windows with fitted initial states.
///
/// It is corrected for the degrees of freedom of the initial states.
fn short_window_residuals(
    model: &Model,
    system: &EquationSystem,
    records: &[Record],
) -> anyhow::Result<Vec<f64>> {
    let (outputs, values) = (model.outputs.len(), model.nominals());
    let length = EXTRA_SAMPLES + 2 * model.states.len();
    let windows: Vec<(&Record, usize)> = records
        .iter()
        .flat_map(|r| {
            (0..(r.times.len() + 1).saturating_sub(length)).step_by(length).map(move |first| (r, first))
        })
        .collect();
    let stride = windows.len().div_ceil(MAX_WINDOWS).max(1);
    let mean_squares = |(record, first): (&Record, usize)| -> Option<Vec<f64>> {
        let samples = first..first + length;
        let mut part = Record { times: record.times[samples.clone()].to_vec(), ..record.clone() };
        part.values.iter_mut().for_each(|v| *v = v[samples.clone()].to_vec());
        system.prepare(&mut part, &[]).ok()?;
        let from = part.windows.first()?.start.clone();
        let declared = vec![None; outputs];
        let initial_state = estimate_initial_state(system, &part, length, &values, &from, &declared).ok()?;
        let readings = (length * outputs) as f64;
        let widen = readings / (readings - initial_state.state.len() as f64).max(1.0);
        Some(initial_state.rmse.into_iter().map(|rms| widen * rms * rms).collect())
    };
    let chosen: Vec<(&Record, usize)> = windows.into_iter().step_by(stride).collect();
    let squares: Vec<Vec<f64>> = chosen.into_par_iter().filter_map(mean_squares).collect();
    let median = |o: usize| {
        let mut list: Vec<f64> = squares.iter().map(|s| s[o]).filter(|v| v.is_finite()).collect();
        list.sort_by(f64::total_cmp);
        list.get(list.len() / 2).map_or(0.0, |square| square.sqrt())
    };
    Ok((0..outputs).map(median).collect())
}

/// Notes for the user on inputs whose hold is not declared (taken as linear) or which are delayed.
pub fn notes(model: &Model) -> Vec<String> {
    let mut notes = Vec::new();
    for input in &model.inputs {
        let name = &input.name;
        if input.hold.is_none() {
            notes.push(format!(
                "{name}: the model does not declare its interpolation between samples (hold), so linear interpolation is used; `augsim fit` \
                 chooses it from data"
            ));
        }
        if input.delay.is_some() {
            notes.push(format!("{name}: the net uses the delayed signal at the samples"));
        }
    }
    notes
}

/// Converts measured trajectories to training sequences: estimated states, with the inputs at their samples.
///
/// # Errors
/// The sampling step differs from the engine's, or the model cannot be simulated over the records.
pub fn sequences(data: &Dataset, engine: &EquationEngine) -> anyhow::Result<Sequences> {
    let model = engine.equations();
    let records = records(data, model, true)?;
    let columns = model.states.iter().map(|s| s.name.clone()).collect();
    let action_columns = engine.action_columns().to_vec();
    check_step_of_engine(engine, &records)?;
    // The measurement noise is that of the engine, not estimated again.
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

/// Inputs of the engine's steps (actions) from an unprepared record, `[sample, action]`.
///
/// Actions are the inputs, delayed where the model says so, then the second derivatives of spline inputs, and the time.
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
