//! Features, targets and scales of nets that correct rates.

use crate::engine::EquationMotion;
use crate::prepared::Prepared;
use crate::scales::{Scales, positive};
use crate::sequences::{Sequence, Sequences};
use crate::steps::asinh;
use std::f64::consts::TAU;

/// Bound of the absolute value of standardised features.
/// A free run that has left the training range then gets no extreme correction.
const FEATURE_BOUND: f64 = 6.0;
/// Factor by which small state values are magnified in the compressed feature of a state.
/// A twentieth of its spread stays visible around 0, where friction changes sign.
const ZERO_MAGNIFICATION: f64 = 20.0;
/// Number of features (net inputs) per state; the next constant is that per input of the system.
const FEATURES_PER_STATE: usize = 3;
const FEATURES_PER_INPUT: usize = 2;

/// Number of net inputs (features) of an interval.
pub(crate) fn width(motion: &EquationMotion) -> usize {
    FEATURES_PER_STATE * motion.periods().len() + FEATURES_PER_INPUT * motion.inputs()
}

/// Number of values of each normalisation scale: means, standard deviations, steps of states, and [`Units`].
pub(crate) fn scale_sizes(motion: &EquationMotion) -> [usize; 4] {
    let (states, d) = (motion.periods().len(), motion.corrected_count());
    let read = states + motion.inputs();
    [read, read, states, 3 * d + 1]
}

/// Units of the corrections of rates, per second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Units<'a> {
    /// Unit of the training targets: root mean square error of the physics' rates in training.
    pub target: &'a [f64],
    /// Unit of the predicted means in a forecast: the target unit times the shrinkage factor.
    pub mean: &'a [f64],
    /// Unit of the predicted standard deviations in a forecast: the target unit times the spread factor.
    pub deviation: &'a [f64],
    /// Correlation time of the random part of the corrections in a forecast, in sample intervals.
    pub correlation_intervals: f64,
}

impl<'a> Units<'a> {
    /// Reads the units of the corrections from the normalisation scales of a run.
    pub fn from_scales(scales: &'a Scales) -> Self {
        let (memory, units) = scales.correction.split_last().unwrap_or((&0.0, &[]));
        let (target, prediction_units) = units.split_at(units.len() / 3);
        let (mean, deviation) = prediction_units.split_at(target.len());
        Units { target, mean, deviation, correlation_intervals: *memory }
    }
}

/// How much of a net's corrections is applied: factors of their means and of their random part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionShrinkage {
    /// Shrinkage factor of the mean corrections; 0 applies no correction to the physics.
    pub gain: f64,
    /// Factor of the predicted standard deviations of the corrections.
    pub spread: f64,
    /// Correlation time of the random part of the corrections, in sample intervals; 0 means independent.
    pub correlation_intervals: f64,
}

impl CorrectionShrinkage {
    /// No shrinkage and independent noise: the corrections as the net was trained.
    pub const FULL: CorrectionShrinkage =
        CorrectionShrinkage { gain: 1.0, spread: 1.0, correlation_intervals: 0.0 };
}

/// Stores the shrinkage factors of the corrections in the normalisation scales.
pub(crate) fn set_shrinkage(scales: &mut Scales, trust: CorrectionShrinkage) {
    let d = scales.correction.len() / 3;
    for k in 0..d {
        scales.correction[d + k] = trust.gain * scales.correction[k];
        scales.correction[2 * d + k] = trust.spread * scales.correction[k];
    }
    scales.correction[3 * d] = trust.correlation_intervals;
}

/// Reads the shrinkage factors of the corrections from the normalisation scales.
pub(crate) fn read_shrinkage(scales: &Scales) -> CorrectionShrinkage {
    let units = Units::from_scales(scales);
    let factor_of = |prediction_units: &[f64]| {
        prediction_units.first().zip(units.target.first()).map_or(1.0, |(v, unit)| v / unit)
    };
    CorrectionShrinkage {
        gain: factor_of(units.mean),
        spread: factor_of(units.deviation),
        correlation_intervals: units.correlation_intervals,
    }
}

/// Predicts the state at the end of each interval of a record with the physics, `[time - 1, S]`.
fn predicted(motion: &EquationMotion, q: &Sequence) -> Vec<f64> {
    let (s, a) = (q.states.len() / q.time, q.actions.len() / q.time);
    let rows = q.time - 1;
    let mut next = vec![0.0; rows * s];
    motion.advance(&q.states[..rows * s], &q.actions[..rows * a], &q.actions[a..], &mut next);
    next
}

/// Fits the normalisation scales on the training segments.
pub(crate) fn fit(motion: &EquationMotion, train: &Sequences) -> Scales {
    let (s, inputs, d) = (motion.periods().len(), motion.inputs(), motion.corrected_count());
    let mut sums = vec![[0.0; 2]; s + inputs];
    let (mut samples, mut rows) = (0.0, 0.0);
    let (mut step_squares, mut correction_squares) = (vec![0.0; s], vec![0.0; d]);
    let mut rates = vec![0.0; d];
    for q in &train.items {
        for t in 0..q.time {
            let values = q.state(t).iter().chain(&q.action(t)[..inputs]);
            sums.iter_mut().zip(values).for_each(|(sum, v)| {
                sum[0] += v;
                sum[1] += v * v;
            });
        }
        samples += q.time as f64;
        for (t, next) in predicted(motion, q).chunks_exact(s).enumerate() {
            motion.required_corrections(next, q.state(t + 1), &mut rates);
            // An interval where the simulation failed is left out of the scales.
            if next.iter().all(|x| x.is_finite()) {
                rows += 1.0;
                step_squares
                    .iter_mut()
                    .zip(next.iter().zip(q.state(t)))
                    .for_each(|(to, (b, a))| *to += (b - a).powi(2));
                correction_squares.iter_mut().zip(&rates).for_each(|(to, rate)| *to += rate * rate);
            }
        }
    }
    let mean: Vec<f64> = sums.iter().map(|s| s[0] / samples).collect();
    let sd = sums.iter().zip(&mean).map(|(s, m)| positive((s[1] / samples - m * m).max(0.0).sqrt(), 0.0));
    let rms = |v: Vec<f64>| -> Vec<f64> { v.into_iter().map(|v| positive((v / rows).sqrt(), 0.0)).collect() };
    let mut scales =
        Scales { sd: sd.collect(), mean, step: rms(step_squares), correction: vec![0.0; 3 * d + 1] };
    scales.correction[..d].copy_from_slice(&rms(correction_squares));
    set_shrinkage(&mut scales, CorrectionShrinkage::FULL);
    scales
}

/// Computes the targets and features of a segment, one row per interval.
pub(crate) fn prepare(motion: &EquationMotion, scales: &Scales, q: &Sequence) -> Prepared {
    let (s, d, u_width) = (motion.periods().len(), motion.corrected_count(), width(motion));
    let (mut x, mut u) = (Vec::with_capacity((q.time - 1) * d), vec![0.0; (q.time - 1) * u_width]);
    let mut rates = vec![0.0; d];
    let next = predicted(motion, q);
    for (t, (next, row)) in next.chunks_exact(s).zip(u.chunks_exact_mut(u_width)).enumerate() {
        if !next.iter().all(|x| x.is_finite()) {
            // An interval where the simulation failed has target and features 0.
            x.extend(std::iter::repeat_n(0.0, d));
            continue;
        }
        write(motion, scales, q.state(t), next, [q.action(t), q.action(t + 1)], row);
        motion.required_corrections(next, q.state(t + 1), &mut rates);
        x.extend(
            rates.iter().zip(Units::from_scales(scales).target).map(|(rate, unit)| (rate / unit) as f32),
        );
    }
    Prepared { time: q.time - 1, x_width: d, u_width, x, u }
}

/// Writes the features (net inputs) of an interval to `out`.
/// They are the states at its beginning (sine and cosine of periodic ones), the changes predicted by the
/// physics, and the inputs at its beginning and its end.
pub(crate) fn write(
    motion: &EquationMotion,
    scales: &Scales,
    now: &[f64],
    next: &[f64],
    actions: [&[f64]; 2],
    out: &mut [f32],
) {
    let s = now.len();
    let standard =
        |j: usize, v: f64| ((v - scales.mean[j]) / scales.sd[j]).clamp(-FEATURE_BOUND, FEATURE_BOUND) as f32;
    for (j, out) in out[..FEATURES_PER_STATE * s].chunks_exact_mut(FEATURES_PER_STATE).enumerate() {
        let pair = match motion.periods()[j] {
            Some(period) => {
                let (sin, cos) = (TAU * now[j] / period).sin_cos();
                [sin as f32, cos as f32]
            }
            None => {
                let magnified = asinh(ZERO_MAGNIFICATION * now[j] / scales.sd[j]) / 4.0;
                [standard(j, now[j]), magnified.clamp(-FEATURE_BOUND, FEATURE_BOUND) as f32]
            }
        };
        let change = ((next[j] - now[j]) / scales.step[j]).clamp(-FEATURE_BOUND, FEATURE_BOUND) as f32;
        out.copy_from_slice(&[pair[0], pair[1], change]);
    }
    for (k, out) in out[FEATURES_PER_STATE * s..].chunks_exact_mut(FEATURES_PER_INPUT).enumerate() {
        out.copy_from_slice(&actions.map(|action| standard(s + k, action[k])));
    }
}
