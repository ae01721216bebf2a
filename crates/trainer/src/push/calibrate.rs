//! Calibration of the declared pushing model on measured pushes: least squares through the simulator.
//!
//! Levenberg and Marquardt's method on the logarithms of c, contact friction and rod radius; residuals are position
//! errors and c-weighted angle errors of open-loop roll-outs. A push whose error is far beyond the others' (a knock
//! by hand) is weighted down by Huber's rule. Intervals come from the sandwich estimator with one cluster a recording
//! (White 1980; Liang and Zeger 1986), since windows of one recording are not independent.

use crate::engine::ModelPush;
use crate::{Sequence, Sequences, TrainerError};
use augsim_physics::model::PushModel;
use augsim_physics::push::{C, CONTACT_FRICTION, ROD_RADIUS};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Parameters that are fitted, in this order: places among those of the model.
const FITTED: [usize; 3] = [C, CONTACT_FRICTION, ROD_RADIUS];
/// Huber's threshold, in medians of the pushes' root mean square errors.
const HUBER: f64 = 2.0;
/// Step of the derivatives, on logarithms.
const STEP: f64 = 1e-3;
const ITERATIONS: usize = 20;

/// One fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Name, with unit.
    pub name: String,
    /// Declared value.
    pub nominal: f64,
    /// Fitted value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// The fitted model.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The model with fitted parameters.
    pub model: PushModel,
    /// The parameters.
    pub estimates: Vec<Estimate>,
}

type Row = Vec<f64>;

fn with(model: &PushModel, logs: &[f64; 3]) -> PushModel {
    let mut model = model.clone();
    FITTED.iter().zip(logs).for_each(|(place, log)| model.parameters[*place].nominal = log.exp());
    model
}

fn residuals(engine: &ModelPush, weight_m: f64, q: &Sequence) -> Row {
    let path = engine.poses(q.state(0), &q.actions);
    let rows = path.chunks_exact(3).zip(q.states.chunks_exact(3));
    rows.flat_map(|(p, s)| [p[0] - s[0], p[1] - s[1], weight_m * (p[2] - s[2])]).collect()
}

fn rms(r: &[f64]) -> f64 {
    (r.iter().map(|v| v * v).sum::<f64>() / r.len() as f64).sqrt()
}

/// Fits c, contact friction and rod radius to measured pushes. A sequence's recording is what its name says before
/// an `@`.
///
/// # Errors
/// No push to fit to.
pub fn calibrate(model: &PushModel, pushes: &Sequences) -> Result<Calibration, TrainerError> {
    if pushes.items.is_empty() {
        return Err(TrainerError::NoTrajectories { what: "the set to calibrate on" });
    }
    let nominal = FITTED.map(|place| model.parameters[place].nominal);
    let weight_m = nominal[0];
    let all = |logs: &[f64; 3]| -> Vec<Row> {
        let engine = ModelPush::new(&with(model, logs));
        pushes.items.par_iter().map(|q| residuals(&engine, weight_m, q)).collect()
    };
    let mut logs = nominal.map(f64::ln);
    let mut now = all(&logs);
    let mut errors: Vec<f64> = now.iter().map(|r| rms(r)).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let limit = HUBER * errors[errors.len() / 2].max(1e-9);
    // Huber's loss of a push's root mean square error.
    let loss = |rows: &[Row]| -> f64 {
        let one = |e: f64| if e <= limit { 0.5 * e * e } else { limit * (e - 0.5 * limit) };
        rows.iter().map(|r| one(rms(r))).sum()
    };
    let (mut value, mut damping) = (loss(&now), 1e-3);
    let mut normal = Normal::default();
    for _ in 0..ITERATIONS {
        normal = Normal::new(pushes, &now, &jacobians(&all, &logs, &now), limit);
        let Some(step) = normal.step(damping) else { break };
        let mut moved = logs;
        (0..3).for_each(|k| moved[k] -= step[k].clamp(-0.3, 0.3));
        let next = all(&moved);
        let new_value = loss(&next);
        if new_value < value {
            let done = value - new_value < 1e-9 * value;
            (logs, now, value, damping) = (moved, next, new_value, (damping * 0.2).max(1e-9));
            if done {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    let sd = normal.sandwich().unwrap_or([f64::INFINITY; 3]);
    let estimates = (0..3).map(|k| Estimate {
        name: model.parameters[FITTED[k]].name.clone(),
        nominal: nominal[k],
        value: logs[k].exp(),
        ci95: [-1.96, 1.96].map(|z| (logs[k] + z * sd[k]).exp()),
    });
    Ok(Calibration { model: with(model, &logs), estimates: estimates.collect() })
}

/// Derivatives of all residuals by each parameter.
fn jacobians(all: &dyn Fn(&[f64; 3]) -> Vec<Row>, logs: &[f64; 3], now: &[Row]) -> [Vec<Row>; 3] {
    [0, 1, 2].map(|k| {
        let mut moved = *logs;
        moved[k] += STEP;
        let difference = |(a, b): (&Row, &Row)| a.iter().zip(b).map(|(a, b)| (a - b) / STEP).collect();
        all(&moved).iter().zip(now).map(difference).collect()
    })
}

/// The weighted normal equations, and the gradient of each recording.
#[derive(Debug, Default)]
struct Normal {
    matrix: [[f64; 3]; 3],
    gradient: [f64; 3],
    clusters: BTreeMap<String, [f64; 3]>,
}

impl Normal {
    fn new(pushes: &Sequences, now: &[Row], slopes: &[Vec<Row>; 3], limit: f64) -> Self {
        let mut out = Normal::default();
        for (i, q) in pushes.items.iter().enumerate() {
            let weight = (limit / rms(&now[i])).min(1.0) / now[i].len() as f64;
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() * weight;
            let recording = q.id.split('@').next().unwrap_or_default().to_owned();
            let cluster = out.clusters.entry(recording).or_default();
            for a in 0..3 {
                let g = dot(&slopes[a][i], &now[i]);
                out.gradient[a] += g;
                cluster[a] += g;
                for b in 0..3 {
                    out.matrix[a][b] += dot(&slopes[a][i], &slopes[b][i]);
                }
            }
        }
        out
    }

    fn step(&self, damping: f64) -> Option<[f64; 3]> {
        let mut m = self.matrix;
        (0..3).for_each(|k| m[k][k] *= 1.0 + damping);
        let inverse = inverse(&m)?;
        Some([0, 1, 2].map(|a| (0..3).map(|b| inverse[a][b] * self.gradient[b]).sum()))
    }

    /// Standard deviations of the logarithms.
    fn sandwich(&self) -> Option<[f64; 3]> {
        let inverse = inverse(&self.matrix)?;
        let count = self.clusters.len() as f64;
        let correction = if count > 1.0 { count / (count - 1.0) } else { return None };
        let variance = |k: usize| {
            let along = |g: &[f64; 3]| (0..3).map(|b| inverse[k][b] * g[b]).sum::<f64>().powi(2);
            self.clusters.values().map(along).sum::<f64>() * correction
        };
        Some([0, 1, 2].map(|k| variance(k).sqrt()))
    }
}

fn inverse(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let minor = |r: usize, c: usize| {
        let [r1, r2] = [(r + 1) % 3, (r + 2) % 3];
        let [c1, c2] = [(c + 1) % 3, (c + 2) % 3];
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * minor(0, c)).sum();
    let scale = m[0][0] * m[1][1] * m[2][2];
    (determinant.abs() > 1e-14 * scale.abs())
        .then(|| [0, 1, 2].map(|r| [0, 1, 2].map(|c| minor(c, r) / determinant)))
}
