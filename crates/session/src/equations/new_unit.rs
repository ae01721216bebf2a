//! The model of one new unit, from its first runs and the distribution over the units that were fitted before.
//!
//! Parameters that all units share keep their values. A parameter with one value per group has, before the runs, the
//! normal distribution of mean `m` and standard deviation `s` over groups (empirical Bayes; Morris 1983). With the
//! estimates `x` from the runs alone and their covariance `V`, and with `S` the diagonal matrix of the variances `s^2`:
//!
//! ```text
//! (1)  mean          m + S (S + V)^-1 (x - m)
//! (2)  covariance    S - S (S + V)^-1 S
//! ```

use super::fit::Fitted;
use augsim_data::{Dataset, Trajectory};
use augsim_equations::Model;
use augsim_equations::model::Covariance;
use augsim_linear::{Mat, solve_positive_definite};
use std::collections::BTreeSet;
use thiserror::Error;

/// Standard deviation of a prior that says nothing, relative to the standard error of the estimate.
const VAGUE_PRIOR_RATIO: f64 = 1e3;

/// Error: the model or the data do not allow a fit of a new unit.
#[derive(Debug, Error)]
enum NewUnitFault {
    #[error(
        "--new-unit: {model} has no parameter with `per = \"group\"`, so all units are equal; leave the option out, or discover the values \
         by group first"
    )]
    EqualUnits { model: String },
    #[error("--new-unit: the data contain {count} groups; give the runs of one unit only")]
    SeveralUnits { count: usize },
}

/// The model of a new unit before its fit: one value of each parameter, of which only those with values by group are free.
///
/// # Errors
/// No parameter has values by group, or the data contain several groups.
pub(super) fn model_of_unit(fleet: &Model, data: &Dataset) -> anyhow::Result<Model> {
    if fleet.parameters.iter().all(|p| p.by_group.is_none()) {
        return Err(NewUnitFault::EqualUnits { model: fleet.file.clone() }.into());
    }
    let groups: BTreeSet<&str> = data.trajectories().iter().filter_map(Trajectory::group).collect();
    if groups.len() > 1 {
        return Err(NewUnitFault::SeveralUnits { count: groups.len() }.into());
    }
    let mut model = fleet.clone();
    for p in &mut model.parameters {
        p.frozen = p.by_group.is_none();
        p.by_group = None;
    }
    Ok(model)
}

/// Combines the fit of a new unit with the distribution over the units of `fleet`, formulas (1) and (2).
///
/// The other parameters keep the values and intervals of the fleet.
pub(super) fn combine_with_distribution(fitted: &mut Fitted, fleet: &Model) {
    let is_free = |i: &usize| fleet.parameters[*i].by_group.is_some();
    let free: Vec<usize> = (0..fleet.parameters.len()).filter(is_free).collect();
    let calibration = &fitted.calibration;
    // Without a standard error the runs say nothing about the parameter.
    let known: Vec<usize> = free
        .iter()
        .copied()
        .filter(|i| calibration.standard_errors[*i].is_some_and(|e| e.is_finite() && e > 0.0))
        .collect();
    let variance_of = |i: usize| {
        let vague = || VAGUE_PRIOR_RATIO * calibration.standard_errors[i].unwrap_or(1.0);
        fleet.parameters[i].by_group.as_ref().and_then(|g| g.sd).unwrap_or_else(vague).powi(2)
    };
    let n = known.len();
    let sum = Mat::from_fn(n, n, |a, b| {
        calibration.covariance[known[a]][known[b]] + if a == b { variance_of(known[a]) } else { 0.0 }
    });
    let difference =
        Mat::from_fn(n, 1, |a, _| calibration.values[known[a]] - fleet.parameters[known[a]].nominal);
    let prior = Mat::from_fn(n, n, |a, b| if a == b { variance_of(known[a]) } else { 0.0 });
    let (Some(weighted), Some(reduced)) =
        (solve_positive_definite(&sum, &difference), solve_positive_definite(&sum, &prior))
    else {
        return;
    };
    let covariance = |a: usize, b: usize| {
        let own = if a == b { variance_of(known[a]) } else { 0.0 };
        own - variance_of(known[a]) * reduced[(a, b)]
    };
    let values: Vec<f64> = (0..n)
        .map(|a| fleet.parameters[known[a]].nominal + variance_of(known[a]) * weighted[(a, 0)])
        .collect();
    let rows: Vec<Vec<f64>> = (0..n).map(|a| (0..n).map(|b| covariance(a, b)).collect()).collect();
    let model = &mut fitted.model;
    for (p, declared) in model.parameters.iter_mut().zip(&fleet.parameters) {
        (p.frozen, p.ci95) = (declared.frozen, declared.ci95);
        if let Some(sd) = declared.by_group.as_ref().and_then(|g| g.sd) {
            p.set_estimate(declared.nominal, sd);
        }
    }
    for (a, i) in known.iter().enumerate() {
        model.parameters[*i].set_estimate(values[a], rows[a][a].max(0.0).sqrt());
    }
    model.covariance = Some(Covariance { parameters: known, rows });
}
