//! Evidence of a recording for an explanation, given all that was known before it.
//!
//! The parameters have the normal distribution of the explanation as their prior. A few Gauss-Newton steps from the
//! stored values lead to the most probable parameters and initial state; there the marginal density of the readings is
//! formula (2) of `projection.rs`. The density of the first samples, which determine the initial state, is divided out:
//! what counts is the density of the later samples given these, so that the prior of the initial state has no influence.
//!
//! The product of such predictive densities over recordings is the marginal likelihood of all (Dawid 1984).

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::linearise::{Start, start_readings};
use crate::projection::Projection;
use crate::whiten::whiten;
use augsim_system::{Record, shortest_difference};

/// Maximum number of Gauss-Newton steps; predictions that are nearly linear in the parameters need one or two.
const MAX_STEPS: usize = 15;
/// Decrease of twice the negative log density below which the steps have converged, nats.
const MIN_DECREASE: f64 = 1e-3;
/// Shares of a Gauss-Newton step that are tried.
const STEP_SHARES: [f64; 5] = [1.0, 0.3, 0.1, 0.03, 0.01];

/// What a recording says about an explanation.
#[derive(Clone, Debug)]
pub struct Heard {
    /// Logarithm of the density of the later samples given the first ones and all earlier recordings, nats.
    pub log_evidence: f64,
    /// The explanation with the parameters and the covariance after the recording.
    pub updated: Explanation,
    /// Sum of the squares of the standardised prediction errors of the later samples.
    pub squares: f64,
    /// Number of these prediction errors; `squares` is about as large if the explanation holds.
    pub count: usize,
}

/// An evaluation of the density at one point.
pub(crate) struct Evaluated {
    pub sums: Projection,
    first: Projection,
    /// Half the log determinant of the noise covariance of the readings after the first.
    half_log_variance: f64,
    later: usize,
    /// Gauss-Newton step of all unknowns by this recording alone.
    pub own_step: Vec<f64>,
    /// Twice the negative log density at the point, without constants.
    pub cost: f64,
}

/// Computes the evidence of a recording for an explanation, and the explanation's update.
///
/// # Errors
/// The recording cannot be simulated, or the density is not finite.
pub fn hear(explanation: &Explanation, record: &Record) -> Result<Heard, DesignError> {
    let (record, start) = explanation.opened(record, None)?;
    let p = explanation.uncertain.len();
    let mut u = vec![0.0; p + start.unknown().len()];
    let mut now = evaluate(explanation, &record, &start, &u)?;
    for _ in 0..MAX_STEPS {
        let step = now.own_step.clone();
        let better = STEP_SHARES.iter().find_map(|share| {
            let moved: Vec<f64> = u.iter().zip(&step).map(|(u, d)| u + share * d).collect();
            let there = evaluate(explanation, &record, &start, &moved).ok()?;
            (there.cost < now.cost).then_some((moved, there))
        });
        let Some((moved, there)) = better else { break };
        let decrease = now.cost - there.cost;
        (u, now) = (moved, there);
        if decrease < MIN_DECREASE {
            break;
        }
    }
    let (all, first) = (now.sums.minimum(0, &u), now.first.minimum(0, &u));
    let squares = all - first;
    let log_evidence = -0.5 * squares
        - (now.sums.half_log_determinant - now.first.half_log_determinant)
        - now.half_log_variance
        - 0.5 * now.later as f64 * std::f64::consts::TAU.ln();
    if !log_evidence.is_finite() {
        return Err(DesignError::NotFinite { name: explanation.name.clone(), record: record.id.clone() });
    }
    Ok(Heard { log_evidence, updated: explanation.after(&now.sums, &u[..p]), squares, count: now.later })
}

/// Linearises the explanation at the coordinates `u` and sums the readings.
pub(crate) fn evaluate(
    e: &Explanation,
    record: &Record,
    start: &Start,
    u: &[f64],
) -> Result<Evaluated, DesignError> {
    let (xi, starts) = u.split_at(e.uncertain.len());
    let values = e.values_at(xi);
    let out = e.simulate(record, &values, &start.at(starts), &e.seeds(start))?;
    let channels = &e.system.schema().channels;
    let residual = |sample: usize, output: usize, _| {
        let measured = record.values[output].get(sample).copied().unwrap_or(f64::NAN);
        shortest_difference(measured - out.value(sample, output), channels[output].period)
    };
    let mut columns = e.columns(&out, start, 1, residual);
    let intervals = e.intervals(record, &values, &out)?;
    let half_logs = whiten(&e.noise, &record.times, &mut columns, &intervals);
    let (rows, first_rows) = (columns.readings.len(), start_readings(&columns, start));
    let not_finite = || DesignError::NotFinite { name: e.name.clone(), record: record.id.clone() };
    let sums = Projection::new(&columns, 1, rows).ok_or_else(not_finite)?;
    let first = Projection::new(&columns, 1, first_rows).ok_or_else(not_finite)?;
    let cost = sums.squares[0] + u.iter().map(|u| u * u).sum::<f64>() + 2.0 * half_logs.iter().sum::<f64>();
    let half_log_variance = half_logs[first_rows..].iter().sum();
    let own_step = sums.step(0, u);
    Ok(Evaluated { sums, own_step, first, half_log_variance, later: rows - first_rows, cost })
}
