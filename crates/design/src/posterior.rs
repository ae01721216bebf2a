//! Distribution of the parameters after the recordings so far, under the noise of the explanation.
//!
//! The prior of a parameter is as wide as its bounds. With u the coordinates of the parameters under the prior, and each
//! recording r linearised at its own initial state, the elimination of that state leaves
//!
//! ```text
//! (1)  (I + A_r) d_r = b_r - u,    (I + A_r)⁻¹ = block of the parameters of H_r⁻¹,    d_r = step of r alone
//! (2)  (I + Σ A_r) δ = Σ b_r - u
//! ```
//!
//! Gauss-Newton steps by (2) lead to the most probable parameters; (I + Σ A_r)⁻¹ is their covariance (Laplace).

use crate::error::DesignError;
use crate::evidence::{Evaluated, evaluate};
use crate::explanation::{Explanation, factor_of};
use crate::linearise::Start;
use augsim_linear::{Mat, invert_positive_definite};
use augsim_system::Record;
use rayon::prelude::*;

/// Maximum number of Gauss-Newton steps from the fitted values.
const MAX_STEPS: usize = 20;
/// Decrease of twice the negative log density below which the steps have converged, nats.
const MIN_DECREASE: f64 = 1e-2;
/// Shares of a step that are tried.
const STEP_SHARES: [f64; 4] = [1.0, 0.3, 0.1, 0.03];
/// Standard deviation of the prior of a parameter without finite bounds, in standard errors of its fit.
const PRIOR_ERRORS: f64 = 100.0;

/// A recording with its initial state, in coordinates of its prior.
struct Part {
    record: Record,
    start: Start,
    u: Vec<f64>,
}

/// Computes the distribution of an explanation's parameters after recordings, from a prior as wide as their bounds.
///
/// # Errors
/// A recording cannot be simulated at the fitted values.
pub fn after_recordings(explanation: &Explanation, records: &[Record]) -> Result<Explanation, DesignError> {
    let broad = with_prior(explanation);
    let p = broad.uncertain.len();
    let part = |record: &Record| {
        let (record, start) = broad.opened(record, None)?;
        Ok(Part { record, u: vec![0.0; start.unknown().len()], start })
    };
    let mut parts: Vec<Part> = records.iter().map(part).collect::<Result<_, DesignError>>()?;
    // The fitted values in coordinates of the prior, whose factor is diagonal.
    let coordinate = |(k, index): (usize, &usize)| match broad.factor[k][k] {
        sd if sd > 0.0 => (explanation.values[*index] - broad.values[*index]) / sd,
        _ => 0.0,
    };
    let mut xi: Vec<f64> = broad.uncertain.iter().enumerate().map(coordinate).collect();
    let mut now = evaluate_all(&broad, &parts, &xi)?;
    let mut sums = Sums::new(&now.1, &parts, &xi, p);
    for _ in 0..MAX_STEPS {
        let Some(step) = sums.as_ref().map(|s| s.step.clone()) else { break };
        let moved = |share: f64| {
            let there: Vec<f64> = xi.iter().zip(&step).map(|(x, d)| x + share * d).collect();
            let parts = moved_parts(&parts, &now.1, &step, share, p);
            let value = evaluate_all(&broad, &parts, &there).ok()?;
            (value.0 < now.0).then_some((there, parts, value))
        };
        let Some((there, new_parts, value)) = STEP_SHARES.into_iter().find_map(moved) else { break };
        let decrease = now.0 - value.0;
        (xi, parts, now) = (there, new_parts, value);
        sums = Sums::new(&now.1, &parts, &xi, p);
        if decrease < MIN_DECREASE {
            break;
        }
    }
    let Some(sums) = sums else { return Ok(explanation.clone()) };
    Ok(Explanation { values: broad.values_at(&xi), factor: factor_of(&sums.covariance(&broad)), ..broad })
}

/// The explanation with a prior as wide as the bounds of each parameter, about their middle.
fn with_prior(e: &Explanation) -> Explanation {
    let mut broad = e.clone();
    let count = e.uncertain.len();
    broad.factor = vec![vec![0.0; count]; count];
    for (k, (index, fitted_sd)) in e.uncertain.iter().zip(e.standard_deviations()).enumerate() {
        let p = &e.system.parameters()[*index];
        let width = (p.max - p.min) / 12.0_f64.sqrt();
        let most = PRIOR_ERRORS * fitted_sd;
        // Bounds far wider than the fit's error add nothing; a prior about the fitted value is then as good.
        if width.is_finite() && (width <= most || fitted_sd <= 0.0) {
            broad.values[*index] = 0.5 * (p.min + p.max);
            broad.factor[k][k] = width;
        } else {
            broad.factor[k][k] = most;
        }
    }
    broad
}

/// Evaluates all recordings; returns twice the negative log density, and the evaluations.
fn evaluate_all(e: &Explanation, parts: &[Part], xi: &[f64]) -> Result<(f64, Vec<Evaluated>), DesignError> {
    let one = |part: &Part| {
        let u: Vec<f64> = xi.iter().chain(&part.u).copied().collect();
        evaluate(e, &part.record, &part.start, &u)
    };
    let all: Vec<Evaluated> = parts.par_iter().map(one).collect::<Result<_, _>>()?;
    // Each evaluation has the prior of the parameters once; it counts once in all.
    let prior: f64 = xi.iter().map(|x| x * x).sum();
    let cost = all.iter().map(|one| one.cost - prior).sum::<f64>() + prior;
    Ok((cost, all))
}

/// The recordings with their initial states moved for a share of the joint step of the parameters.
fn moved_parts(parts: &[Part], evaluated: &[Evaluated], step: &[f64], share: f64, p: usize) -> Vec<Part> {
    let moved = |(part, one): (&Part, &Evaluated)| {
        let u = part.u.clone();
        let mut moved = Part { record: part.record.clone(), start: part.start.clone(), u };
        if moved.u.is_empty() {
            return moved;
        }
        let own = one.own_step.clone();
        let Some(block) = block_inverse(one, p) else { return moved };
        // Given the joint step, the state follows its regression on the parameters.
        let gap: Vec<f64> = (0..p).map(|i| step[i] - own[i]).collect();
        let weights: Vec<f64> = (0..p).map(|i| (0..p).map(|j| block[(i, j)] * gap[j]).sum()).collect();
        for (s, u) in moved.u.iter_mut().enumerate() {
            let by_parameters: f64 = (0..p).map(|j| one.sums.inverse[(p + s, j)] * weights[j]).sum();
            *u += share * (own[p + s] + by_parameters);
        }
        moved
    };
    parts.iter().zip(evaluated).map(moved).collect()
}

/// I + A_r of (1): the inverse of the parameters' block of H⁻¹.
fn block_inverse(one: &Evaluated, p: usize) -> Option<Mat<f64>> {
    let lower = Mat::from_fn(p, p, |i, j| if i >= j { one.sums.inverse[(i, j)] } else { 0.0 });
    invert_positive_definite(lower).map(|inverted| inverted.inverse)
}

/// Sums (2) over recordings.
struct Sums {
    /// Joint step δ of the parameters.
    step: Vec<f64>,
    /// Inverse of I + Σ A_r.
    inverse: Mat<f64>,
}

impl Sums {
    /// `None` if the sums are not positive definite.
    fn new(evaluated: &[Evaluated], parts: &[Part], xi: &[f64], p: usize) -> Option<Self> {
        let mut matrix = Mat::<f64>::identity(p, p);
        let mut right: Vec<f64> = xi.iter().map(|x| -x).collect();
        for (one, _) in evaluated.iter().zip(parts) {
            let block = block_inverse(one, p)?;
            for i in 0..p {
                right[i] += xi[i] + (0..p).map(|j| block[(i, j)] * one.own_step[j]).sum::<f64>();
                for j in 0..p {
                    matrix[(i, j)] += block[(i, j)] - if i == j { 1.0 } else { 0.0 };
                }
            }
        }
        let lower = Mat::from_fn(p, p, |i, j| if i >= j { matrix[(i, j)] } else { 0.0 });
        let inverse = invert_positive_definite(lower)?.inverse;
        let step = (0..p).map(|i| (0..p).map(|j| inverse[(i, j)] * right[j]).sum()).collect();
        Some(Self { step, inverse })
    }

    /// Covariance of the parameters, in their units.
    fn covariance(&self, prior: &Explanation) -> Vec<Vec<f64>> {
        let sd = |i: usize| prior.factor[i][i];
        let p = prior.uncertain.len();
        (0..p).map(|i| (0..p).map(|j| sd(i) * self.inverse[(i, j)] * sd(j)).collect()).collect()
    }
}
