//! Noise of the motion: what shakes a rate, told from what a sensor adds, and the states that remain.
//!
//! A model that is simulated from a start says that nothing happens on the way but what its equations say. Where that is not so,
//! misfits grow with the time since the start. Here each force and flow equation may be pushed by a number that wanders about 0
//! (an Ornstein-Uhlenbeck process, of which white noise is the limit), or each reading be shifted by one; how much, and for how
//! long, is what makes the readings likeliest. States come from an iterated extended Kalman smoother (Bell, SIAM Journal on
//! Optimization 4, 1994), variances from the balance of its sums.

use crate::along::{Drive, Interval};
use crate::outcome::CalibrationError;
use crate::variances::{Hypothesis, Noisy};
use augsim_physics::system::{Record, System};
use rayon::prelude::*;

/// Correlation times that are tried, in sampling steps, beside white noise. The longest are far longer than most recordings: there the noise is an
/// offset that differs from recording to recording.
const MEMORIES: [f64; 10] = [2.0, 6.0, 20.0, 60.0, 200.0, 600.0, 2e3, 6e3, 2e4, 6e4];
/// Factors by which the best of these is varied, one after the other.
const FINER: [f64; 3] = [1.8, 1.35, 1.15];
/// Samples on which causes are compared.
const COMPARED: usize = 6000;
/// Smoothed paths on the way to the last.
const PATHS: usize = 8;
/// Gain in ln likelihood that each further number of a cause has to bring.
const WORTH: f64 = 5.0;

/// The cause by which readings differ from a run of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The sensor alone, each reading for itself.
    Sensor,
    /// The sensor, whose errors last from reading to reading.
    LastingSensor,
    /// The sensor, and what shakes the motion.
    Motion,
}

/// States and noise of records under a model.
#[derive(Clone, Debug)]
pub struct Smoothed {
    /// The likeliest cause.
    pub cause: Cause,
    /// Standard deviation of what pushes the rate of each shaken state, in the unit of the rate, averaged over a step from sample
    /// to sample; that of what shifts each channel where the cause is a lasting sensor; empty where it is the sensor alone.
    pub drive_sd: Vec<f64>,
    /// Seconds over which it wanders (its correlation falls to 1/e); 0 where it is anew with every sample.
    pub memory_s: f64,
    /// Standard deviation of each reading for itself, by channel, in its unit.
    pub sensor_sd: Vec<f64>,
    /// Ln likelihood of the readings under each cause: the sensor alone, a lasting sensor, a shaken motion; minus infinity for one
    /// under which no motion of the model is near them.
    pub ln_likelihood: [f64; 3],
    /// States of each record given all of its readings, `[record][sample][state]` in one row.
    pub paths: Vec<Vec<f64>>,
    /// The cause with its variances.
    pub(crate) hypothesis: Hypothesis,
}

/// A cause along paths of its own.
pub(crate) struct Judged {
    pub hypothesis: Hypothesis,
    pub paths: Vec<Vec<f64>>,
    /// Ln likelihood less what its numbers have to bring.
    worth: f64,
    /// Whether the paths stay where they are when they are smoothed once more.
    stays: bool,
}

/// States and noise of prepared records at these values of the parameters.
///
/// `system` shows its states as channels behind its `outputs` outputs; the rates of the states in `pushed` may be pushed; `declared`
/// are standard deviations of sensors that are known, by output.
///
/// # Errors
/// [`CalibrationError`]: nothing was measured, or an interval cannot be simulated.
pub fn smooth(
    system: &dyn System,
    outputs: usize,
    records: &[Record],
    values: &[f64],
    pushed: &[usize],
    declared: &[Option<f64>],
) -> Result<Smoothed, CalibrationError> {
    let problem = Noisy::new(system, outputs, records, values, pushed, declared)?;
    // A shaken motion goes along with any readings; under another cause there may be no motion near them.
    let mut best = problem.shaken(values)?;
    let (mut cause, mut ln_likelihood) =
        (Cause::Motion, [f64::NEG_INFINITY, f64::NEG_INFINITY, best.hypothesis.ll]);
    let runs = problem.runs(values).unwrap_or_default();
    let readings: Vec<Drive> = (0..outputs).map(Drive::Reading).collect();
    let others = [(Cause::LastingSensor, readings, 1), (Cause::Sensor, Vec::new(), 0)];
    for (other, drives, place) in others.into_iter().filter(|_| !runs.is_empty()) {
        if let Ok(found) = problem.judged(values, drives, runs.clone())
            && found.stays
        {
            ln_likelihood[place] = found.hypothesis.ll;
            if found.worth >= best.worth {
                (cause, best) = (other, found);
            }
        }
    }
    let Judged { hypothesis: best, paths, .. } = best;
    let n = problem.shown.states;
    Ok(Smoothed {
        cause,
        drive_sd: (0..best.drives.len()).map(|j| best.noise.first[n + j].sqrt()).collect(),
        memory_s: best.memory * problem.step_s(),
        sensor_sd: best.noise.read.iter().map(|v| v.sqrt()).collect(),
        ln_likelihood,
        paths,
        hypothesis: best,
    })
}

impl Noisy<'_> {
    /// A shaken motion, along paths that rough variances lead to first.
    pub(crate) fn shaken(&self, values: &[f64]) -> Result<Judged, CalibrationError> {
        let rough_path = |record| self.rough_path(record, values);
        let paths: Result<Vec<Vec<f64>>, _> = self.records.par_iter().map(rough_path).collect();
        let mut paths = paths.map_err(CalibrationError::Simulation)?;
        let shaken = self.hypothesis(self.rates_pushed(), 0.0);
        self.settled(shaken, values, &mut paths, 3)?;
        self.judged(values, self.rates_pushed(), paths)
    }

    /// A cause along paths of its own, which begin at these: through an event, those of another are no motions of the model.
    pub(crate) fn judged(
        &self,
        values: &[f64],
        drives: Vec<Drive>,
        mut paths: Vec<Vec<f64>>,
    ) -> Result<Judged, CalibrationError> {
        let along = self.intervals(values, &paths, &[])?;
        let found = with_memory(self, &drives, &paths, &along);
        let (hypothesis, stays) = self.settled(found, values, &mut paths, PATHS)?;
        let numbers = hypothesis.drives.len() as f64 + if hypothesis.memory > 0.0 { 1.0 } else { 0.0 };
        let worth = hypothesis.ll - WORTH * numbers;
        Ok(Judged { hypothesis, paths, worth, stays })
    }
}

/// A cause with the memory under which its readings are likeliest along these paths. Each memory begins with rough variances: one
/// that is next to nothing under the memory before would hardly grow again.
fn with_memory(
    problem: &Noisy<'_>,
    drives: &[Drive],
    paths: &[Vec<f64>],
    along: &[Vec<Interval>],
) -> Hypothesis {
    let few = compared(problem.records);
    let at =
        |memory: f64| problem.balanced(problem.hypothesis(drives.to_vec(), memory), paths, along, &few).0;
    let mut best = at(0.0);
    let mut worse = 0;
    for memory in MEMORIES.iter().filter(|_| !drives.is_empty()) {
        let found = at(*memory);
        if found.ll > best.ll {
            (best, worse) = (found, 0);
        } else {
            worse += 1;
        }
        if worse == 2 {
            break;
        }
    }
    let wanders = best.memory > 0.0;
    for factor in FINER.iter().filter(|_| wanders) {
        for memory in [best.memory / factor, best.memory * factor] {
            let found = at(memory);
            if found.ll > best.ll {
                best = found;
            }
        }
    }
    best
}

/// How many samples of each record causes are compared on.
fn compared(records: &[Record]) -> Vec<usize> {
    let mut left = COMPARED;
    let take = |record: &Record| {
        let samples = record.times.len().min(left);
        left -= samples;
        samples
    };
    records.iter().map(take).collect()
}
