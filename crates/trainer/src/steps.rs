//! Targets and conditions where single physics steps are corrected; the paper's nets give states outright.

use crate::engine::Engine;
use crate::prepared::Prepared;
use crate::recipe::Recipe;
use crate::scales::{Scales, positive};
use crate::sequences::{Sequence, Sequences};

/// How fast the compressed features grow: about a thousandth of the states' spread stays visible.
const FINE: f64 = 500.0;

/// Features of a state column.
const FEATURES: usize = 5;

/// Size of the smallest physics step that corrections are measured against, in units of the root mean
/// square step: at an apex or at rest the physics hardly moves, but may still be wrong.
const QUIET: f64 = 0.05;

/// Fits all scales on a training set, for corrections of the engine's steps.
pub(crate) fn fit(engine: &Engine, train: &Sequences) -> Scales {
    fit_with(&|now, from, to, next| engine.step(now, from, to, next), train)
}

/// The step that is corrected: state, actions before and after, next state.
pub(crate) type Step<'a> = dyn Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a;

/// Fits all scales on a training set, for corrections of any step.
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
    /// Unit in which column `j`'s correction of a physics step from `now` to `next` is measured: it grows
    /// with how far the physics moves, so that a wrong restitution and a wrong drag are of one size.
    pub(crate) fn unit(&self, j: usize, now: &[f64], next: &[f64]) -> f64 {
        self.unit_of(j, next[j] - now[j])
    }

    /// [`unit`](Self::unit) where the physics moves column `j` by `moved`.
    pub(crate) fn unit_of(&self, j: usize, moved: f64) -> f64 {
        self.correction[j] * (moved.abs() / self.step[j] + QUIET)
    }

    /// A value of column `j` in standard units, and compressed by asinh.
    pub(crate) fn state_features(&self, j: usize, value: f64) -> [f32; 2] {
        let wide = ((value - self.mean[j]) / self.sd[j]) as f32;
        [wide, (asinh(FINE * value / self.sd[j]) / 4.0) as f32]
    }

    /// Features of one physics step from `now` to `next`, written to `out`: both states in standard
    /// units, both compressed by asinh so that what happens near zero (a ball about to rest) stays
    /// visible, and the step in its own unit.
    pub(crate) fn write_features(&self, now: &[f64], next: &[f64], out: &mut [f32]) {
        for j in 0..now.len() {
            let ([now_wide, now_fine], [next_wide, next_fine]) =
                (self.state_features(j, now[j]), self.state_features(j, next[j]));
            let moved = ((next[j] - now[j]) / self.step[j]) as f32;
            let features = [now_wide, next_wide, now_fine, next_fine, moved];
            out[FEATURES * j..FEATURES * (j + 1)].copy_from_slice(&features);
        }
    }
}

/// Writes what Hybrid+ reads of single steps.
#[derive(Debug, Default)]
pub(crate) struct StepReading {
    changes: Vec<f64>,
}

impl StepReading {
    /// Writes features of the step from `now` to `next` to `row`, and behind them the engine's [`Engine::own_changes`] `[P, S]` in
    /// units of corrections.
    pub(crate) fn write(
        &mut self,
        (engine, scales): (&Engine, &Scales),
        [now, next]: [&[f64]; 2],
        [from, to]: [&[f64]; 2],
        row: &mut [f32],
    ) {
        let s = now.len();
        let (features, own) = row.split_at_mut(FEATURES * s);
        scales.write_features(now, next, features);
        self.changes.resize(own.len(), 0.0);
        engine.own_changes(now, from, to, &mut self.changes);
        for (i, (slot, change)) in own.iter_mut().zip(&self.changes).enumerate() {
            *slot = (change / scales.unit(i % s, now, next)) as f32;
        }
    }
}

/// Inverse hyperbolic sine. Beyond 1 the textbook form has all digits that a feature keeps, and takes a third of the time of the
/// library's, which is exact near 0: half of a filter's time went there.
pub(crate) fn asinh(x: f64) -> f64 {
    let size = x.abs();
    if size > 1.0 { (size + (size * size + 1.0).sqrt()).ln().copysign(x) } else { x.asinh() }
}

/// Width of a condition row.
pub(crate) fn width(recipe: Recipe, engine: &Engine, state: usize) -> usize {
    match recipe {
        Recipe::Neural => state,
        Recipe::Hybrid | Recipe::HybridStandardised => 2 * state,
        // As many as `StepReading` writes; classes of the league have widths of their own.
        _ => (FEATURES + engine.own_parameters()) * state,
    }
}

/// Targets and conditions of `recipe` over a whole trajectory.
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
        // Classes of the league prepare their own.
        _ => {
            let (rows, u_width) = (q.time - 1, width(recipe, engine, s));
            let (mut x, mut u) = (Vec::with_capacity(rows * s), vec![0.0; rows * u_width]);
            let (mut next, mut reading) = (vec![0.0; s], StepReading::default());
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

/// Conditions `[time, U]` of the paper's nets, from the first state alone: s_0, and for Hybrid the
/// physics roll-out.
pub(crate) fn conditions(
    recipe: Recipe,
    engine: &Engine,
    scales: &Scales,
    start: &[f64],
    actions: &[f64],
    time: usize,
) -> Vec<f32> {
    let s = start.len();
    let path = match recipe {
        Recipe::Neural => Vec::new(),
        _ => engine.rollout(start, actions, time),
    };
    let mut u = Vec::with_capacity(time * 2 * s);
    for t in 0..time {
        u.extend(start.iter().map(|v| *v as f32));
        if !path.is_empty() {
            u.extend(path[t * s..(t + 1) * s].iter().map(|v| *v as f32));
        }
    }
    if recipe == Recipe::HybridStandardised {
        scales.standardise(&mut u);
    }
    u
}
