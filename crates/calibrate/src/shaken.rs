//! Parameters under a motion that is shaken.
//!
//! A fit over windows takes every misfit for one of the sensor. Under noise of the motion the likelihood of readings is that of what
//! a filter does not foretell of them (Ljung, System Identification, 1999, section 7.4; Ansley and Kohn, Annals of Statistics 13, 1985);
//! steps are those of Gauss and Newton at the filter's gains.

use crate::along::{Interval, Layout};
use crate::kalman::{Filter, Sample, diagonal};
use crate::outcome::CalibrationError;
use crate::smooth::{Cause, Judged, Smoothed};
use crate::variances::{Hypothesis, Noisy};
use augsim_linear::{Mat, SymmetricEigen, symmetric_eigen};
use augsim_physics::system::{Begin, Record, System};
use rayon::prelude::*;

/// Times that the memory of what shakes is chosen anew.
const ROUNDS: usize = 4;
/// Halvings of a step.
const HALVINGS: usize = 4;
/// Smoothed paths after each step.
const PATHS: usize = 3;
/// Factors by which the memory of what shakes is varied.
const MEMORIES: [f64; 3] = [2.0, 1.4, 1.15];
/// Memory from which a longer one is tried where there was none, in steps from sample to sample.
const LEAST_MEMORY: f64 = 0.5;
/// Gain in ln likelihood below which a step is the last.
const SETTLED: f64 = 0.05;
/// Curvature of a direction, in that of its parameters alone, below which readings tell nothing of it, as where parameters do
/// the same.
const TELLS: f64 = 1e-4;

/// A parameter that is fitted: its place in the vector, and its range.
pub type Fitted = (usize, [f64; 2]);

/// Readings of a system whose motion is shaken.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    /// Number of outputs.
    pub outputs: usize,
    /// Prepared records.
    pub records: &'a [Record],
    /// Standard deviations of sensors that are known, by output.
    pub declared: &'a [Option<f64>],
}

/// A system that shows its states as channels behind its outputs, the states whose rates may be pushed, and values of all of its
/// parameters.
#[derive(Clone, Copy, Debug)]
pub struct Pushed<'a> {
    /// The system.
    pub system: &'a dyn System,
    /// Numbers of the states that may be pushed.
    pub states: &'a [usize],
    /// Values of all parameters.
    pub values: &'a [f64],
}

/// Parameters under which readings are likeliest where the motion is shaken.
#[derive(Clone, Debug)]
pub struct FitIfShaken {
    /// Values of all parameters.
    pub values: Vec<f64>,
    /// Ln likelihood of the readings with nothing known of where records begin.
    pub ln_likelihood: f64,
    hypothesis: Hypothesis,
    paths: Vec<Vec<f64>>,
}

/// Noise and states as they are known before a fit.
#[derive(Clone, Copy, Debug)]
pub enum Known<'a> {
    /// Those of the same model, smoothed at the values that the fit begins at, where their cause is the motion.
    Smoothed(&'a Smoothed),
    /// The fit of another model to the same records, where that has as many states.
    Other(&'a FitIfShaken),
}

/// Fits the parameters in `free` under a motion that is shaken, from the values of `model` on, with what is known of noise and states; where
/// that does not hold for this model, they are found first.
///
/// # Errors
/// [`CalibrationError`]: nothing was measured, or an interval cannot be simulated at the values given.
pub fn fit_if_shaken(
    readings: Readings<'_>,
    model: Pushed<'_>,
    free: &[Fitted],
    known: Known<'_>,
) -> Result<FitIfShaken, CalibrationError> {
    let problem = readings.noisy(&model)?;
    let mut values = model.values.to_vec();
    let known = match known {
        Known::Smoothed(found) => (found.cause == Cause::Motion)
            .then(|| Place { hypothesis: found.hypothesis.clone(), paths: found.paths.clone() }),
        Known::Other(fit) => problem.begun_at(&values, fit),
    };
    let mut at = match known {
        Some(at) => at,
        None => {
            let Judged { hypothesis, paths, .. } = problem.shaken(&values)?;
            Place { hypothesis, paths }
        }
    };
    for _ in 0..ROUNDS {
        let before = at.hypothesis.ll;
        while !free.is_empty() && problem.descend(&mut at, &mut values, free)? > SETTLED {}
        // Under other values what shakes the motion may wander for another time.
        problem.remember(&mut at, &values)?;
        if at.hypothesis.ll - before < SETTLED {
            break;
        }
    }
    let ln_likelihood = problem.diffuse(&at.hypothesis);
    Ok(FitIfShaken { values, ln_likelihood, hypothesis: at.hypothesis, paths: at.paths })
}

/// Noise and states under some values.
struct Place {
    hypothesis: Hypothesis,
    paths: Vec<Vec<f64>>,
}

impl<'a> Readings<'a> {
    fn noisy(&self, model: &Pushed<'a>) -> Result<Noisy<'a>, CalibrationError> {
        Noisy::new(model.system, self.outputs, self.records, model.values, model.states, self.declared)
    }
}

/// How the ln likelihood of readings bends with parameters, and its slope.
#[derive(Clone, Debug)]
struct Curvature {
    /// `[P][P]`, in rows.
    bends: Vec<f64>,
    /// `[P]`
    slope: Vec<f64>,
}

impl Curvature {
    /// The step of Gauss and Newton, along directions that bend by more than [`TELLS`]; none where none does.
    fn step(&self) -> Option<Vec<f64>> {
        let p = self.slope.len();
        let bend = |i: usize, j: usize| self.bends[i * p + j];
        let size = |i: usize| bend(i, i).max(f64::MIN_POSITIVE).sqrt();
        let scaled = Mat::from_fn(p, p, |i, j| bend(i, j) / (size(i) * size(j)));
        let SymmetricEigen { values: bends, vectors: directions } = symmetric_eigen(&scaled)?;
        let mut step = vec![0.0; p];
        for direction in (0..p).filter(|d| bends[*d] > TELLS) {
            let slope: f64 = (0..p).map(|i| directions[(i, direction)] * self.slope[i] / size(i)).sum();
            let by = slope / bends[direction];
            step.iter_mut().enumerate().for_each(|(i, to)| *to += by * directions[(i, direction)] / size(i));
        }
        (step.iter().any(|x| *x != 0.0) && step.iter().all(|x| x.is_finite())).then_some(step)
    }
}

impl Noisy<'_> {
    /// The ln likelihood as it would be with nothing known of where records begin (de Jong, Biometrika 75, 1988): how wide a start was
    /// taken to be is a choice, and no model is likelier for it.
    fn diffuse(&self, hypothesis: &Hypothesis) -> f64 {
        let states = &self.shown.system.schema().states;
        let open = states.iter().zip(&hypothesis.noise.first);
        let open = open.filter(|(state, _)| matches!(state.begin, Begin::Free | Begin::Measured(_)));
        let widths: f64 = open.map(|(_, variance)| variance.ln()).sum();
        hypothesis.ll + 0.5 * widths * self.records.len() as f64
    }

    /// Whether the paths of a fit are of states such as these.
    fn has_states_of(&self, fit: &FitIfShaken) -> bool {
        let as_long =
            |(record, path): (&Record, &Vec<f64>)| path.len() == record.times.len() * self.shown.states;
        fit.hypothesis.drives == self.rates_pushed() && self.records.iter().zip(&fit.paths).all(as_long)
    }

    /// Noise and states that settle from those of another model; `None` where they cannot.
    fn begun_at(&self, values: &[f64], other: &FitIfShaken) -> Option<Place> {
        let mut paths = self.has_states_of(other).then(|| other.paths.clone())?;
        let (hypothesis, stays) =
            self.settled(other.hypothesis.clone(), values, &mut paths, 2 * PATHS).ok()?;
        (stays && hypothesis.ll.is_finite()).then_some(Place { hypothesis, paths })
    }

    /// Lets what shakes the motion wander for longer or for less long, as readings are likelier.
    fn remember(&self, at: &mut Place, values: &[f64]) -> Result<(), CalibrationError> {
        let along = self.intervals(values, &at.paths, &[])?;
        let all: Vec<usize> = self.records.iter().map(|record| record.times.len()).collect();
        let before = at.hypothesis.memory;
        let mut best = at.hypothesis.clone();
        for factor in MEMORIES {
            for memory in [best.memory / factor, best.memory.max(LEAST_MEMORY) * factor] {
                let other = self.with_memory(&best, memory);
                let (found, _) = self.balanced(other, &at.paths, &along, &all);
                if found.ll > best.ll {
                    best = found;
                }
            }
        }
        if best.memory != before {
            let mut paths = at.paths.clone();
            let (hypothesis, _) = self.settled(best, values, &mut paths, PATHS)?;
            if hypothesis.ll > at.hypothesis.ll {
                *at = Place { hypothesis, paths };
            }
        }
        Ok(())
    }

    /// A cause whose drives wander for another time, by as much.
    fn with_memory(&self, from: &Hypothesis, memory: f64) -> Hypothesis {
        let n = self.shown.states;
        let variances = from.noise.first[n..].to_vec();
        let mut other = Hypothesis { memory, ..from.clone() };
        self.set_drives(&mut other, &variances);
        other
    }

    /// One step of the parameters in `free`, with noise and paths that settle after it; what the ln likelihood gains by it.
    fn descend(
        &self,
        at: &mut Place,
        values: &mut Vec<f64>,
        free: &[Fitted],
    ) -> Result<f64, CalibrationError> {
        let moving: Vec<usize> = free.iter().map(|(place, _)| *place).collect();
        let along = self.intervals(values, &at.paths, &moving)?;
        let curvature = self.curvature(&at.hypothesis, &at.paths, &along, moving.len());
        let Some(step) = curvature.step() else { return Ok(0.0) };
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let mut next = values.clone();
            for ((place, [low, high]), by) in free.iter().zip(&step) {
                next[*place] = (next[*place] + share * by).clamp(*low, *high);
            }
            let mut paths = at.paths.clone();
            if let Ok((found, _)) = self.settled(at.hypothesis.clone(), &next, &mut paths, PATHS) {
                let gain = found.ll - at.hypothesis.ll;
                if gain > 0.0 {
                    (at.hypothesis, at.paths, *values) = (found, paths, next);
                    return Ok(gain);
                }
            }
            share *= 0.5;
        }
        Ok(0.0)
    }

    /// The curvature by `parameters` parameters whose derivatives the intervals have, at the gains of a filter along these paths.
    fn curvature(
        &self,
        hypothesis: &Hypothesis,
        paths: &[Vec<f64>],
        along: &[Vec<Interval>],
        parameters: usize,
    ) -> Curvature {
        let layout =
            Layout { shown: self.shown, drives: &hypothesis.drives, memory: hypothesis.correlation() };
        let of_record = |((record, path), intervals): ((&Record, &Vec<f64>), &Vec<Interval>)| {
            let samples = layout.samples(record, path, intervals);
            curvature(&samples, intervals, hypothesis, parameters)
        };
        let parts: Vec<Curvature> = self.records.par_iter().zip(paths).zip(along).map(of_record).collect();
        let zero = Curvature { bends: vec![0.0; parameters * parameters], slope: vec![0.0; parameters] };
        parts.iter().fold(zero, |mut sum, part| {
            sum.bends.iter_mut().zip(&part.bends).for_each(|(to, from)| *to += from);
            sum.slope.iter_mut().zip(&part.slope).for_each(|(to, from)| *to += from);
            sum
        })
    }
}

/// The curvature of one record: the filter runs over its samples, and the derivatives of its mean along with it.
fn curvature(
    samples: &[Sample],
    along: &[Interval],
    hypothesis: &Hypothesis,
    parameters: usize,
) -> Curvature {
    let noise = &hypothesis.noise;
    let (d, p) = (noise.first.len(), parameters);
    let mut filter = Filter::new(diagonal(&noise.first), vec![0.0; d]);
    // Derivatives of the filter's mean, `[D][P]`, in rows.
    let mut moved = vec![0.0; d * p];
    let mut sum = Curvature { bends: vec![0.0; p * p], slope: vec![0.0; p] };
    for (k, (sample, interval)) in samples.iter().zip(along).enumerate() {
        for reading in &sample.readings {
            // Of what is foretold.
            let mut foretold = interval.output_by_parameter[reading.channel * p..][..p].to_vec();
            for (row, by) in moved.chunks_exact(p).zip(&reading.by) {
                foretold.iter_mut().zip(row).for_each(|(to, from)| *to += by * from);
            }
            let (unforeseen, variance) = filter.take(reading, noise.read[reading.channel]);
            for i in 0..p {
                sum.slope[i] += foretold[i] * unforeseen / variance;
                (0..p).for_each(|j| sum.bends[i * p + j] += foretold[i] * foretold[j] / variance);
            }
            for (row, gain) in moved.chunks_exact_mut(p).zip(&filter.gain) {
                row.iter_mut().zip(&foretold).for_each(|(to, by)| *to -= gain * by);
            }
        }
        if k + 1 < samples.len() {
            filter.advance(sample, &noise.added);
            let mut next = vec![0.0; d * p];
            for (to, by) in next.chunks_exact_mut(p).zip(sample.next.chunks_exact(d)) {
                for (row, by) in moved.chunks_exact(p).zip(by) {
                    to.iter_mut().zip(row).for_each(|(to, from)| *to += by * from);
                }
            }
            next.iter_mut().zip(&interval.by_parameter).for_each(|(to, by)| *to += by);
            moved = next;
        }
    }
    sum
}
