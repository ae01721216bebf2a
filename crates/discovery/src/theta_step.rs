//! Steps of the shared parameters theta, with the nuisances of the windows eliminated.

use crate::evaluate::{Lanes, NormalEquations};
use crate::fit_state::State;
use crate::hypothesis::Hypothesis;
use crate::linear::{Square, eliminate};

/// Maximum length of the step tried after a rejected one, relative to the rejected one.
const RETRY_LENGTH: f64 = 0.4;
/// Levenberg-Marquardt damping beyond which no further step is tried.
const MAX_DAMPING: f64 = 1e9;
/// Maximum share of a window's curvature along its gradient by which the robust cost may reduce it.
const MAX_SOFTENED_SHARE: f64 = 0.5;

/// A step of theta, the vector of shared parameters.
pub(crate) struct Step {
    pub change: Vec<f64>,
    /// Predicted decrease of the cost along the step, if the nuisances (initial state, record parameters,
    /// event offsets) are refitted.
    pub predicted_decrease: f64,
    /// Length of the step, measured with the diagonal of the curvature.
    pub length: f64,
}

impl Step {
    /// The step of length 0.
    pub fn none(theta: &[f64]) -> Self {
        Self { change: vec![0.0; theta.len()], predicted_decrease: 0.0, length: 0.0 }
    }
}

/// Increases the damping until the step is clearly shorter than `failed`, the rejected one. A slightly
/// shorter step would be rejected as well. Returns the step and its damping.
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
        if step.length <= RETRY_LENGTH * failed.length || lambda > MAX_DAMPING {
            return (step, lambda);
        }
        lambda *= 4.0;
    }
}

/// Curvature and gradient of the cost in theta (the shared parameters), with the nuisances (initial state,
/// record parameters, event offsets) eliminated. The diagonals of the windows' curvatures are multiplied by
/// `1 + damping`.
///
/// The robust cost has less curvature than the sum of squares. With missing effects, where residuals are
/// large, steps that ignore this are too short by a factor.
pub(crate) fn curvature(
    h: &Hypothesis,
    lanes: &[Lanes],
    normals: &[NormalEquations],
    damping: f64,
) -> (Square, Vec<f64>) {
    let n = h.theta_len();
    let (mut s, mut u) = (Square::zero(n), vec![0.0; n]);
    for (l, normal) in lanes.iter().zip(normals) {
        let (sj, uj, _) = eliminate(&normal.h.damped(damping), &normal.g, l.common());
        // At most half of the curvature along the gradient is removed. For starts near the solution nothing
        // is, which gives Gauss-Newton steps.
        let mut softening = if h.system.starts_from_first_samples() { normal.softening } else { 0.0 };
        if softening > 0.0 {
            let mut reached = uj.clone();
            sj.cholesky().forward(&mut reached);
            let share = reached.iter().map(|x| x * x).sum::<f64>();
            softening = softening.min(MAX_SOFTENED_SHARE / share.max(f64::MIN_POSITIVE));
        }
        for (a, &ta) in l.theta.iter().enumerate() {
            u[ta] += uj[a];
            for (b, &tb) in l.theta.iter().enumerate() {
                *s.at_mut(ta, tb) += sj.at(a, b) - softening * uj[a] * uj[b];
            }
        }
    }
    (s, u)
}

/// The damped step that minimises the quadratic approximation of the cost within `bounds`. `plain` is the
/// undamped curvature.
pub(crate) fn theta_step(
    h: &Hypothesis,
    lanes: &[Lanes],
    state: &State,
    plain: &Square,
    lambda: f64,
    bounds: &[(f64, f64)],
) -> Step {
    let (s, u) = curvature(h, lanes, &state.normals, lambda);
    let mut free: Vec<usize> = (0..u.len())
        .filter(|&i| {
            let (t, (low, high)) = (state.theta[i], bounds[i]);
            !(t <= low && u[i] < 0.0 || t >= high && u[i] > 0.0)
        })
        .collect();
    let mut step = vec![0.0; u.len()];
    // A parameter that reaches its bound stays there, and the others are solved for again.
    for _ in 0..=u.len() {
        let mut rhs: Vec<f64> = free
            .iter()
            .map(|&i| {
                u[i] - (0..u.len()).filter(|k| !free.contains(k)).map(|k| s.at(i, k) * step[k]).sum::<f64>()
            })
            .collect();
        s.sub(&free).cholesky().solve(&mut rhs);
        let crossing = free.iter().zip(&rhs).position(|(&i, d)| {
            let t = state.theta[i] + d;
            t < bounds[i].0 || t > bounds[i].1
        });
        match crossing {
            None => {
                free.iter().zip(&rhs).for_each(|(&i, d)| step[i] = *d);
                break;
            }
            Some(k) => {
                let i = free.remove(k);
                step[i] = (state.theta[i] + rhs[k]).clamp(bounds[i].0, bounds[i].1) - state.theta[i];
            }
        }
    }
    let predicted_decrease = plain.cost_decrease(&u, &step);
    let length = (0..u.len()).map(|i| plain.at(i, i) * step[i] * step[i]).sum::<f64>().sqrt();
    Step { change: step, predicted_decrease, length }
}
