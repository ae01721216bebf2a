//! Steps of what all windows share, each window's own values having followed.

use crate::evaluate::{Lanes, Normal};
use crate::hypothesis::Hypothesis;
use crate::linear::{Square, eliminate};
use crate::state::State;

/// Length of the next step that is tried after one that failed, relative to that.
const SHORTER: f64 = 0.4;
/// Damping beyond which no step is looked for.
const MOST_DAMPING: f64 = 1e9;
/// Share of a window's curvature along its gradient that the logarithm of the misfit may take away.
const MOST_SOFTENED: f64 = 0.5;

/// A step of theta.
pub(crate) struct Step {
    pub change: Vec<f64>,
    /// By how much the cost falls along it in the quadratic approximation, the windows' nuisances following.
    pub promise: f64,
    /// Its length, with the curvatures along the axes as the metric.
    pub length: f64,
}

impl Step {
    /// No step.
    pub fn none(theta: &[f64]) -> Self {
        Self { change: vec![0.0; theta.len()], promise: 0.0, length: 0.0 }
    }
}

/// A step that is clearly shorter than one that failed, and its damping: a little more of it, where that is far below what shortens a
/// step, would only fail again.
pub(crate) fn shorter_step(
    h: &Hypothesis,
    lanes: &[Lanes],
    state: &State,
    plain: &Square,
    mut lambda: f64,
    bounds: &[(f64, f64)],
    failed: &Step,
) -> (Step, f64) {
    loop {
        let step = theta_step(h, lanes, state, plain, lambda, bounds);
        if step.length <= SHORTER * failed.length || lambda > MOST_DAMPING {
            return (step, lambda);
        }
        lambda *= 4.0;
    }
}

/// Curvature and gradient of the cost in theta, the windows' nuisances following, with the diagonal raised by `1 + damping`.
///
/// The cost of a window is a logarithm of its misfit, which bends less than the misfit: where laws are missing, and windows are at
/// odds, steps that do not know this fall short by a factor, again and again.
pub(crate) fn curvature(
    h: &Hypothesis,
    lanes: &[Lanes],
    normals: &[Normal],
    damping: f64,
) -> (Square, Vec<f64>) {
    let n = h.theta_len();
    let (mut s, mut u) = (Square::zero(n), vec![0.0; n]);
    for (l, normal) in lanes.iter().zip(normals) {
        let (sj, uj, _) = eliminate(&normal.h.damped(damping), &normal.g, l.common());
        let mut reached = uj.clone();
        sj.cholesky().forward(&mut reached);
        let share = reached.iter().map(|x| x * x).sum::<f64>();
        // Half of the curvature that is left along the gradient is never taken away. Near the noise nothing is: there the steps are
        // those of Gauss and Newton.
        let most = if h.system.begins_from_first_samples() { normal.softening } else { 0.0 };
        let softening = most.min(MOST_SOFTENED / share.max(f64::MIN_POSITIVE));
        for (a, &ta) in l.theta.iter().enumerate() {
            u[ta] += uj[a];
            for (b, &tb) in l.theta.iter().enumerate() {
                *s.at_mut(ta, tb) += sj.at(a, b) - softening * uj[a] * uj[b];
            }
        }
    }
    (s, u)
}

/// The damped step that lowers the cost most in the quadratic approximation, within `bounds`; `plain` is the curvature at `state`
/// without damping.
pub(crate) fn theta_step(
    h: &Hypothesis,
    lanes: &[Lanes],
    state: &State,
    plain: &Square,
    lambda: f64,
    bounds: &[(f64, f64)],
) -> Step {
    let (s, u) = curvature(h, lanes, &state.normals, lambda);
    let mut moving: Vec<usize> = (0..u.len())
        .filter(|&i| {
            let (t, (low, high)) = (state.theta[i], bounds[i]);
            !(t <= low && u[i] < 0.0 || t >= high && u[i] > 0.0)
        })
        .collect();
    let mut step = vec![0.0; u.len()];
    // A parameter that a step carries to its bound stays there, and the others are solved for again.
    for _ in 0..=u.len() {
        let mut rhs: Vec<f64> = moving
            .iter()
            .map(|&i| {
                u[i] - (0..u.len()).filter(|k| !moving.contains(k)).map(|k| s.at(i, k) * step[k]).sum::<f64>()
            })
            .collect();
        s.sub(&moving).cholesky().solve(&mut rhs);
        let crossing = moving.iter().zip(&rhs).position(|(&i, d)| {
            let t = state.theta[i] + d;
            t < bounds[i].0 || t > bounds[i].1
        });
        match crossing {
            None => {
                moving.iter().zip(&rhs).for_each(|(&i, d)| step[i] = *d);
                break;
            }
            Some(k) => {
                let i = moving.remove(k);
                step[i] = (state.theta[i] + rhs[k]).clamp(bounds[i].0, bounds[i].1) - state.theta[i];
            }
        }
    }
    let promise = plain.fall(&u, &step);
    let length = (0..u.len()).map(|i| plain.at(i, i) * step[i] * step[i]).sum::<f64>().sqrt();
    Step { change: step, promise, length }
}
