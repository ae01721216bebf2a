//! From trajectories to what the nets read: targets and conditions per time step.

use crate::engine::{Engine, EngineSpec};
use crate::push::PushScales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::Recipe;
use serde::{Deserialize, Serialize};

/// How fast the compressed features grow: about a thousandth of the states' spread stays visible.
const FINE: f64 = 500.0;

/// Size of the smallest physics step that corrections are measured against, in units of the root mean
/// square step: at an apex or at rest the physics hardly moves, but may still be wrong.
const QUIET: f64 = 0.05;

/// Scales of states, physics steps and corrections, fitted on the training set only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// Mean of each state column.
    pub mean: Vec<f64>,
    /// Standard deviation of each state column.
    pub sd: Vec<f64>,
    /// Root mean square of one physics step, f_p(s) - s.
    pub step: Vec<f64>,
    /// Root mean square of a correction, s' - f_p(s), relative to the size of the physics step plus
    /// [`QUIET`] (both in units of `step`).
    pub correction: Vec<f64>,
}

impl Scales {
    /// Fits all scales on a training set.
    pub fn fit(engine: &dyn Engine, train: &Sequences) -> Self {
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
                    engine.step(now, q.action(t), q.action(t + 1), &mut next);
                    pairs += 1.0;
                    for j in 0..s {
                        step[j] += (next[j] - now[j]).powi(2);
                    }
                }
            }
        }
        // A column that never changes (or physics that is exact) has scale 1: nothing to scale.
        let positive = |v: f64| if v > 0.0 && v.is_finite() { v } else { 1.0 };
        let mean: Vec<f64> = sum.iter().map(|v| v / n).collect();
        let rms = |v: Vec<f64>| -> Vec<f64> { v.into_iter().map(|v| positive((v / pairs).sqrt())).collect() };
        let sd = sum2.iter().zip(&mean).map(|(v, m)| positive((v / n - m * m).max(0.0).sqrt())).collect();
        let mut scales = Scales { sd, mean, step: rms(step), correction: vec![1.0; s] };
        let mut correction = vec![0.0; s];
        for q in &train.items {
            for t in 0..q.time - 1 {
                let (now, after) = (q.state(t), q.state(t + 1));
                engine.step(now, q.action(t), q.action(t + 1), &mut next);
                for j in 0..s {
                    correction[j] += ((after[j] - next[j]) / scales.unit(j, now, &next)).powi(2);
                }
            }
        }
        scales.correction = rms(correction);
        scales
    }

    /// Unit in which column `j`'s correction of a physics step from `now` to `next` is measured: it grows
    /// with how far the physics moves, so that a wrong restitution and a wrong drag are of one size.
    pub fn unit(&self, j: usize, now: &[f64], next: &[f64]) -> f64 {
        self.correction[j] * ((next[j] - now[j]).abs() / self.step[j] + QUIET)
    }

    /// Rows of states to standard units, in place.
    pub fn standardise(&self, rows: &mut [f32]) {
        for row in rows.chunks_exact_mut(self.mean.len()) {
            for ((v, mean), sd) in row.iter_mut().zip(&self.mean).zip(&self.sd) {
                *v = ((f64::from(*v) - mean) / sd) as f32;
            }
        }
    }

    /// `[time, S, lane]` in standard units back to units of the data, in place.
    pub fn restore(&self, values: &mut [f32], lanes: usize) {
        for (row, v) in values.chunks_exact_mut(lanes).enumerate() {
            let (mean, sd) = (self.mean[row % self.mean.len()], self.sd[row % self.mean.len()]);
            v.iter_mut().for_each(|v| *v = (mean + sd * f64::from(*v)) as f32);
        }
    }

    /// Number of features of a step of `state` columns.
    pub fn features(state: usize) -> usize {
        5 * state
    }

    /// Features of one physics step from `now` to `next`, written to `out`: both states in standard
    /// units, both compressed by asinh so that what happens near zero (a ball about to rest) stays
    /// visible, and the step in its own unit.
    pub fn write_features(&self, now: &[f64], next: &[f64], out: &mut [f32]) {
        for j in 0..now.len() {
            let fine = |v: f64| ((FINE * v / self.sd[j]).asinh() / 4.0) as f32;
            let features = [
                ((now[j] - self.mean[j]) / self.sd[j]) as f32,
                ((next[j] - self.mean[j]) / self.sd[j]) as f32,
                fine(now[j]),
                fine(next[j]),
                ((next[j] - now[j]) / self.step[j]) as f32,
            ];
            out[5 * j..5 * (j + 1)].copy_from_slice(&features);
        }
    }
}

/// Targets and conditions of one trajectory, row-major in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// Rows.
    pub time: usize,
    /// Width of a target row.
    pub x_width: usize,
    /// Width of a condition row.
    pub u_width: usize,
    /// Targets `[time, x_width]`.
    pub x: Vec<f32>,
    /// Conditions `[time, u_width]`.
    pub u: Vec<f32>,
}

/// The scales of a run, by scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Fitted {
    /// States without actions, such as the ball's.
    States(Scales),
    /// Pushes.
    Push(PushScales),
}

impl Fitted {
    /// Fits the scales that `engine` and `recipe` need on a training set.
    pub fn fit(recipe: Recipe, engine: &EngineSpec, train: &Sequences) -> Self {
        match engine {
            EngineSpec::Push(push) => Fitted::Push(PushScales::fit(recipe, push, train)),
            _ => Fitted::States(Scales::fit(engine, train)),
        }
    }

    /// What `recipe` reads of a whole trajectory; `None` if the scales are not the engine's.
    pub fn prepare(&self, recipe: Recipe, engine: &EngineSpec, q: &Sequence) -> Option<Prepared> {
        match (self, engine) {
            (Fitted::Push(scales), EngineSpec::Push(push)) => Some(scales.prepare(recipe, push, q)),
            (Fitted::Push(_), _) | (_, EngineSpec::Push(_)) => None,
            (Fitted::States(scales), _) => Some(prepare(recipe, engine, scales, q)),
        }
    }
}

/// What `recipe` reads of a whole trajectory.
pub fn prepare(recipe: Recipe, engine: &dyn Engine, scales: &Scales, q: &Sequence) -> Prepared {
    let s = q.states.len() / q.time;
    match recipe {
        Recipe::Neural | Recipe::Hybrid | Recipe::HybridStandardised => {
            let u = conditions(recipe, engine, scales, q.state(0), q.time);
            let mut x: Vec<f32> = q.states.iter().map(|v| *v as f32).collect();
            if recipe == Recipe::HybridStandardised {
                scales.standardise(&mut x);
            }
            Prepared { time: q.time, x_width: s, u_width: u.len() / q.time, x, u }
        }
        Recipe::HybridPlus | Recipe::NeuralPlus => {
            let (rows, u_width) = (q.time - 1, Scales::features(s));
            let (mut x, mut u) = (Vec::with_capacity(rows * s), vec![0.0; rows * u_width]);
            let mut next = vec![0.0; s];
            for (t, u) in u.chunks_exact_mut(u_width).enumerate() {
                engine.step(q.state(t), q.action(t), q.action(t + 1), &mut next);
                scales.write_features(q.state(t), &next, u);
                let after = q.state(t + 1);
                x.extend((0..s).map(|j| ((after[j] - next[j]) / scales.unit(j, q.state(t), &next)) as f32));
            }
            Prepared { time: rows, x_width: s, u_width, x, u }
        }
    }
}

/// Conditions `[time, U]` of the paper's nets, from the first state alone: s_0, and for Hybrid the
/// physics roll-out.
pub fn conditions(
    recipe: Recipe,
    engine: &dyn Engine,
    scales: &Scales,
    start: &[f64],
    time: usize,
) -> Vec<f32> {
    let s = start.len();
    let path = match recipe {
        Recipe::Neural => Vec::new(),
        _ => engine.rollout(start, &[], time),
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
