//! Decimation of records: decides whether every n-th sample suffices for a fit.

use super::EquationSystem;
use super::records::{EngineTask, signal};
use super::tuning::windows;
use crate::engine::{OutputChange, Record as EngineRecord, Signal};
use augsim_system::Record;

/// Maximum ratio of the interpolation error over long intervals to that over the shortest intervals.
///
/// Up to this ratio both errors are attributed to measurement noise, which does not grow with the interval.
const MAX_ERROR_RATIO: f64 = 1.1;
/// Weights of four equidistant samples that give the cubic through them at their midpoint.
const MIDPOINT_WEIGHTS: [f64; 4] = [-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0];

impl EquationSystem {
    /// Finds the largest factor, among the powers of two up to `most`, by which records can be decimated.
    ///
    /// The factor is 1 if no other suffices; the records must have been prepared by this system.
    ///
    /// Two conditions must hold. A cubic through samples at that distance must predict the samples halfway
    /// between them as well as one through the nearest neighbours does. Simulations with inputs averaged over
    /// that many samples must have the same outputs as with the measured inputs. Both errors must be small
    /// compared with the measurement noise, as in the choice of steps.
    pub fn max_decimation(&self, most: usize, records: &[Record]) -> usize {
        let noise = self.noise(records);
        let nearest_error = interpolation_error(records, 2, &noise);
        if !nearest_error.is_accepted() {
            return 1;
        }
        let engine_tasks = self.engine_tasks(records);
        let Some(full_outputs) = self.simulated_outputs(&engine_tasks) else { return 1 };
        let is_sufficient = |every: &usize| {
            let error = interpolation_error(records, *every, &noise);
            error.is_accepted()
                && error.root_mean_square <= MAX_ERROR_RATIO * nearest_error.root_mean_square
                && self.has_same_outputs(&engine_tasks, &full_outputs, *every, &noise)
        };
        let doublings = std::iter::successors(Some(2), |every| Some(2 * every)).take_while(|e| *e <= most);
        doublings.take_while(is_sufficient).last().unwrap_or(1)
    }

    /// Whether simulations with every `every`-th knot of their inputs have the same outputs, `full_outputs`.
    fn has_same_outputs(
        &self,
        engine_tasks: &[EngineTask],
        full_outputs: &[Vec<f64>],
        every: usize,
        noise: &[f64],
    ) -> bool {
        let decimated: Option<Vec<EngineTask>> =
            engine_tasks.iter().map(|engine_task| decimate_task(engine_task, every)).collect();
        let Some(decimated) = decimated.and_then(|decimated| self.simulated_outputs(&decimated)) else {
            return false;
        };
        decimated.iter().zip(full_outputs).all(|(decimated, full_outputs)| {
            let kept: Vec<f64> = full_outputs.chunks(noise.len()).step_by(every).flatten().copied().collect();
            OutputChange::compare(decimated, &kept, noise).is_accepted()
        })
    }

    /// Simulates tasks; returns their outputs, `[task][sample * outputs + output]`, or `None` if one fails.
    fn simulated_outputs(&self, engine_tasks: &[EngineTask]) -> Option<Vec<Vec<f64>>> {
        let results = self.compiled.simulate(&windows(engine_tasks), &[], &self.options).into_iter();
        results.map(|run| Some(run.ok()?.values)).collect()
    }

    /// Averages the inputs of a record onto knots at every `every`-th sample, `[input][knot]`.
    pub fn decimated_inputs(&self, record: &Record, every: usize) -> Vec<Vec<f64>> {
        let times = decimate_times(&record.times, every);
        let inputs = self.model().inputs.iter().zip(record.inputs.iter());
        inputs.map(|(input, stream)| signal(input, stream).averaged(&times)).collect()
    }
}

/// Decimates the samples and input knots of a task by `every`; the inputs between the knots are averaged.
fn decimate_task(engine_task: &EngineTask, every: usize) -> Option<EngineTask> {
    let decimate_signal = |signal: &Signal| {
        let knots = decimate_times(signal.knots(), every);
        Signal::new(&knots, &signal.averaged(&knots), signal.hold())
    };
    let inputs = engine_task.record.inputs.iter().map(decimate_signal).collect();
    let record =
        EngineRecord::new(&engine_task.record.name, decimate_times(&engine_task.record.times, every), inputs)
            .ok()?;
    Some(EngineTask { record, ..engine_task.clone() })
}

/// Keeps every n-th of the sample times, n = `every`.
fn decimate_times(times: &[f64], every: usize) -> Vec<f64> {
    times.iter().copied().step_by(every).collect()
}

/// Error of cubics through four samples at the samples halfway between them, in standard deviations of the noise.
///
/// The four samples are `every` samples apart.
fn interpolation_error(records: &[Record], every: usize, noise: &[f64]) -> OutputChange {
    let half_width = every + every / 2;
    let (mut interpolated, mut measured) = (Vec::new(), Vec::new());
    for record in records {
        for sample in (half_width..record.times.len().saturating_sub(half_width)).step_by(every) {
            let neighbours =
                [sample - half_width, sample - every / 2, sample + every / 2, sample + half_width];
            for values in &record.values {
                interpolated.push(
                    neighbours.iter().zip(MIDPOINT_WEIGHTS).map(|(k, weight)| weight * values[*k]).sum(),
                );
                measured.push(values[sample]);
            }
        }
    }
    if measured.is_empty() {
        OutputChange::INFINITE
    } else {
        OutputChange::compare(&interpolated, &measured, noise)
    }
}
