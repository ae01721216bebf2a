//! Least-squares calibration of the declared pushing model on measured pushes.
//!
//! Unknowns are the logarithms of c, contact friction and rod radius. Residuals are the position errors and
//! the angle errors times c of open-loop roll-outs. A push with an error far above the others' (a knock by
//! hand) is weighted down. Intervals come from the sandwich estimator with one cluster per recording (White
//! 1980; Liang and Zeger 1986), because windows of one recording are not independent.

use crate::engine::ModelPush;
use crate::least_squares::{Block, LevenbergMarquardt, Normal};
use crate::{Sequence, Sequences, TrainerError};
use augsim_physics::model::PushModel;
use augsim_physics::push::{C_INDEX, CONTACT_FRICTION_INDEX, ROD_RADIUS_INDEX};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Indices of the fitted parameters among the model's parameters.
const FITTED_INDICES: [usize; 3] = [C_INDEX, CONTACT_FRICTION_INDEX, ROD_RADIUS_INDEX];
/// Settings of the fit; steps are in logarithms of the parameters.
const FIT: LevenbergMarquardt =
    LevenbergMarquardt { difference_step: 1e-3, max_change: 0.3, max_iterations: 20 };

/// Estimate of one fitted parameter, with its confidence interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Name of the fitted parameter, with unit.
    pub name: String,
    /// Declared value of the parameter, in its unit.
    pub nominal: f64,
    /// Fitted value of the parameter, in its unit.
    pub value: f64,
    /// 95 % confidence interval of the fitted parameter, in its unit: lower and upper end.
    pub ci95: [f64; 2],
}

/// Result of a calibration: the fitted model and the estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The pushing model with the fitted parameter values.
    pub model: PushModel,
    /// Estimates of the fitted parameters, with confidence intervals.
    pub estimates: Vec<Estimate>,
}

fn with(model: &PushModel, logs: &[f64]) -> PushModel {
    let mut model = model.clone();
    FITTED_INDICES.iter().zip(logs).for_each(|(index, log)| model.parameters[*index].nominal = log.exp());
    model
}

fn residuals(engine: &ModelPush, weight_m: f64, q: &Sequence) -> Block {
    let path = engine.poses(q.state(0), &q.actions);
    let rows = path.chunks_exact(3).zip(q.states.chunks_exact(3));
    rows.flat_map(|(p, s)| [p[0] - s[0], p[1] - s[1], weight_m * (p[2] - s[2])]).collect()
}

/// Fits the ratio c, the contact friction and the rod radius to measured pushes.
/// The part of a sequence's identifier before an `@` names its recording.
///
/// # Errors
/// [`TrainerError::NoTrajectories`] if there are no pushes.
pub fn calibrate(model: &PushModel, pushes: &Sequences) -> Result<Calibration, TrainerError> {
    if pushes.items.is_empty() {
        return Err(TrainerError::NoTrajectories { what: "the calibration set" });
    }
    let nominal = FITTED_INDICES.map(|index| model.parameters[index].nominal);
    let weight_m = nominal[0];
    let all_residuals = |logs: &[f64]| -> Vec<Block> {
        let engine = ModelPush::new(&with(model, logs));
        pushes.items.par_iter().map(|q| residuals(&engine, weight_m, q)).collect()
    };
    let fit = FIT.run(nominal.map(f64::ln).to_vec(), &all_residuals);
    let logs = [fit.values[0], fit.values[1], fit.values[2]];
    let sd = sandwich(&fit.normal, pushes).unwrap_or([f64::INFINITY; 3]);
    let estimates = (0..3).map(|k| Estimate {
        name: model.parameters[FITTED_INDICES[k]].name.clone(),
        nominal: nominal[k],
        value: logs[k].exp(),
        ci95: [-1.96, 1.96].map(|z| (logs[k] + z * sd[k]).exp()),
    });
    Ok(Calibration { model: with(model, &logs), estimates: estimates.collect() })
}

/// Standard deviations of the log parameters, by the sandwich estimator with one cluster per recording.
/// `None` with fewer than two recordings or a singular normal matrix.
fn sandwich(normal: &Normal, pushes: &Sequences) -> Option<[f64; 3]> {
    let inverse = normal.inverse()?;
    let mut clusters: BTreeMap<&str, [f64; 3]> = BTreeMap::new();
    for (q, gradient) in pushes.items.iter().zip(&normal.gradients) {
        let cluster = clusters.entry(q.id.split('@').next().unwrap_or_default()).or_default();
        cluster.iter_mut().zip(gradient).for_each(|(sum, g)| *sum += g);
    }
    let count = clusters.len() as f64;
    let correction = if count > 1.0 { count / (count - 1.0) } else { return None };
    let variance = |k: usize| {
        let projected = |g: &[f64; 3]| (0..3).map(|b| inverse[k][b] * g[b]).sum::<f64>().powi(2);
        clusters.values().map(projected).sum::<f64>() * correction
    };
    Some([0, 1, 2].map(|k| variance(k).sqrt()))
}
