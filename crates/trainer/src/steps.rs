//! Targets and conditions for Hybrid+ (corrections of single physics steps) and the paper's nets.
//!
//! With s_t the state, f_p the physics step and j a state column:
//! 1. unit k_j = correction_j (|f_p(s_t)_j - s_tj| / step_j + 0.05), with step_j and correction_j root mean
//!    squares over the training set (of physics steps, and of corrections in units of the bracket)
//! 2. target x_tj = (s_{t+1,j} - f_p(s_t)_j) / k_j

use crate::engine::Engine;
use crate::prepared::Prepared;
use crate::recipe::Recipe;
use crate::scales::{Scales, positive};
use crate::sequences::{Sequence, Sequences};

/// Gain of the inverse hyperbolic sine that compresses the state features.
///
/// Resolves about a thousandth of a column's standard deviation near 0.
const ASINH_GAIN: f64 = 500.0;

/// Number of features (net inputs) per state column.
const FEATURES: usize = 5;

/// Constant added to the physics step, relative to its root mean square, in the unit of corrections (formula 1).
///
/// At an apex or at rest the physics step is nearly 0 but may still be wrong, so the unit must not vanish.
const MIN_RELATIVE_STEP: f64 = 0.05;

/// Fits the normalisation scales on a training set, for corrections of the engine's steps.
pub(crate) fn fit(engine: &Engine, train: &Sequences) -> Scales {
    fit_with(&|now, from, to, next| engine.step(now, from, to, next), train)
}

/// Step function that is corrected; arguments: state, action before, action after, next state (written).
pub(crate) type Step<'a> = dyn Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a;

/// Fits the normalisation scales on a training set, for corrections of any step function.
pub(crate) fn fit_with(step_of: &Step<'_>, train: &Sequences) -> Scales {
    let s = train.state_dim();
    let mut next = vec![0.0; s];
    let (mut n, mut sum, mut sum2) = (0.0, vec![0.0; s], vec![0.0; s]);
    let (mut step, mut pairs) = (vec![0.0; s], 0.0);
    for q in &train.items {
        for t in 0..q.time {
            let now = q.state(t);
            n += 1.0;
            for j in 0..s {
                sum[j] += now[j];
                sum2[j] += now[j] * now[j];
            }
            if t + 1 < q.time {
                step_of(now, q.action(t), q.action(t + 1), &mut next);
                pairs += 1.0;
                for j in 0..s {
                    step[j] += (next[j] - now[j]).powi(2);
                }
            }
        }
    }
    let mean: Vec<f64> = sum.iter().map(|v| v / n).collect();
    let rms =
        |v: Vec<f64>| -> Vec<f64> { v.into_iter().map(|v| positive((v / pairs).sqrt(), 0.0)).collect() };
    let sd = sum2.iter().zip(&mean).map(|(v, m)| positive((v / n - m * m).max(0.0).sqrt(), 0.0)).collect();
    let mut scales = Scales { sd, mean, step: rms(step), correction: vec![1.0; s] };
    let mut correction = vec![0.0; s];
    for q in &train.items {
        for t in 0..q.time - 1 {
            let (now, after) = (q.state(t), q.state(t + 1));
            step_of(now, q.action(t), q.action(t + 1), &mut next);
            for j in 0..s {
                correction[j] += ((after[j] - next[j]) / scales.unit(j, now, &next)).powi(2);
            }
        }
    }
    scales.correction = rms(correction);
    scales
}

impl Scales {
    /// Unit of the correction of column `j` for a physics step from `now` to `next` (formula 1).
    ///
    /// It grows with the physics step, so that errors of restitution (rare large steps) and of drag (many
    /// small steps) have similar size in the loss.
    pub(crate) fn unit(&self, j: usize, now: &[f64], next: &[f64]) -> f64 {
        self.unit_of(j, next[j] - now[j])
    }

    /// Unit of the correction of column `j` for a physics step that changes this column by `moved` (formula 1).
    pub(crate) fn unit_of(&self, j: usize, moved: f64) -> f64 {
        self.correction[j] * (moved.abs() / self.step[j] + MIN_RELATIVE_STEP)
    }

    /// Features of a state value in column `j`: in standard units, and compressed by asinh around 0.
    pub(crate) fn state_features(&self, j: usize, value: f64) -> [f32; 2] {
        let standard = ((value - self.mean[j]) / self.sd[j]) as f32;
        [standard, (asinh(ASINH_GAIN * value / self.sd[j]) / 4.0) as f32]
    }

    /// Writes the features of a physics step from `now` to `next` to `out [5 S]`.
    ///
    /// Per column: both states in standard units, both compressed by asinh, which resolves small values near
    /// 0 (a ball about to come to rest), and the step relative to its root mean square.
    pub(crate) fn write_features(&self, now: &[f64], next: &[f64], out: &mut [f32]) {
        for j in 0..now.len() {
            let ([now_standard, now_asinh], [next_standard, next_asinh]) =
                (self.state_features(j, now[j]), self.state_features(j, next[j]));
            let moved = ((next[j] - now[j]) / self.step[j]) as f32;
            let features = [now_standard, next_standard, now_asinh, next_asinh, moved];
            out[FEATURES * j..FEATURES * (j + 1)].copy_from_slice(&features);
        }
    }
}

/// Writes the inputs of Hybrid+ for single steps, one row per step; holds scratch memory.
#[derive(Debug, Default)]
pub(crate) struct StepRowInputs {
    changes: Vec<f64>,
}

impl StepRowInputs {
    /// Writes the features of a physics step to `row`, then its sensitivities `[P, S]` to P physics parameters.
    ///
    /// A sensitivity is the first-order change of the step per typical spread of a trajectory-specific
    /// physics parameter ([`Engine::trajectory_sensitivities`]), in units of corrections. `from` and `to` are the actions
    /// before and after.
    pub(crate) fn write(
        &mut self,
        (engine, scales): (&Engine, &Scales),
        [now, next]: [&[f64]; 2],
        [from, to]: [&[f64]; 2],
        row: &mut [f32],
    ) {
        let s = now.len();
        let (features, sensitivities) = row.split_at_mut(FEATURES * s);
        scales.write_features(now, next, features);
        self.changes.resize(sensitivities.len(), 0.0);
        engine.trajectory_sensitivities(now, from, to, &mut self.changes);
        for (i, (slot, change)) in sensitivities.iter_mut().zip(&self.changes).enumerate() {
            *slot = (change / scales.unit(i % s, now, next)) as f32;
        }
    }
}

/// Computes the inverse hyperbolic sine, with a fast formula for |x| > 1.
///
/// There ln(|x| + sqrt(x^2 + 1)) is exact to single precision and takes 33 % of the time of the library
/// function, which used to take half of a particle filter's time. Near 0 that formula would cancel.
pub(crate) fn asinh(x: f64) -> f64 {
    let size = x.abs();
    if size > 1.0 { (size + (size * size + 1.0).sqrt()).ln().copysign(x) } else { x.asinh() }
}

/// Returns the number of conditions (net inputs) per row for a recipe.
pub(crate) fn width(recipe: Recipe, engine: &Engine, state: usize) -> usize {
    match recipe {
        Recipe::Neural => state,
        Recipe::Hybrid | Recipe::HybridStandardised => 2 * state,
        // The row that `StepRowInputs` writes; league classes define their own widths.
        _ => (FEATURES + engine.sensitivity_count()) * state,
    }
}

/// Computes the targets and conditions (net inputs) of a whole trajectory.
///
/// One row per sample (paper's nets) or per step (Hybrid+).
pub(crate) fn prepare(recipe: Recipe, engine: &Engine, scales: &Scales, q: &Sequence) -> Prepared {
    let s = q.states.len() / q.time;
    match recipe {
        Recipe::Neural | Recipe::Hybrid | Recipe::HybridStandardised => {
            let u = conditions(recipe, engine, scales, q.state(0), &q.actions, q.time);
            let mut x: Vec<f32> = q.states.iter().map(|v| *v as f32).collect();
            if recipe == Recipe::HybridStandardised {
                scales.standardise(&mut x);
            }
            Prepared { time: q.time, x_width: s, u_width: u.len() / q.time, x, u }
        }
        // Hybrid+; league classes prepare their own rows.
        _ => {
            let (rows, u_width) = (q.time - 1, width(recipe, engine, s));
            let (mut x, mut u) = (Vec::with_capacity(rows * s), vec![0.0; rows * u_width]);
            let (mut next, mut reading) = (vec![0.0; s], StepRowInputs::default());
            for (t, u) in u.chunks_exact_mut(u_width).enumerate() {
                engine.step(q.state(t), q.action(t), q.action(t + 1), &mut next);
                reading.write((engine, scales), [q.state(t), &next], [q.action(t), q.action(t + 1)], u);
                let after = q.state(t + 1);
                x.extend((0..s).map(|j| ((after[j] - next[j]) / scales.unit(j, q.state(t), &next)) as f32));
            }
            Prepared { time: rows, x_width: s, u_width, x, u }
        }
    }
}

/// Computes the conditions (net inputs) `[time, U]` of the paper's nets from the initial state.
///
/// These are s_0, and for Hybrid also the physics roll-out.
pub(crate) fn conditions(
    recipe: Recipe,
    engine: &Engine,
    scales: &Scales,
    start: &[f64],
    actions: &[f64],
    time: usize,
) -> Vec<f32> {
    let s = start.len();
    let rollout = match recipe {
        Recipe::Neural => Vec::new(),
        _ => engine.rollout(start, actions, time),
    };
    let mut u = Vec::with_capacity(time * 2 * s);
    for t in 0..time {
        u.extend(start.iter().map(|v| *v as f32));
        if !rollout.is_empty() {
            u.extend(rollout[t * s..(t + 1) * s].iter().map(|v| *v as f32));
        }
    }
    if recipe == Recipe::HybridStandardised {
        scales.standardise(&mut u);
    }
    u
}
