//! Inertias of real bodies that keep the combinations of inertial parameters that a fit identified.
//!
//! Torques depend on base parameters `b = F p` only, where p are the ten parameters of all links. A fit of the model's
//! parameters theta gives `b(theta)` with the covariance `J C J^T`, where J are the derivatives of b and C is the covariance of
//! the inertial parameters while all others (friction, rotors) keep their values: the description file states these as well.

use anyhow::Context;
use augsim_equations::Model;
use augsim_equations::model::{RobotModel, RobotProperties};
use augsim_linear::{Mat, invert_positive_definite};
use augsim_robot::base_parameters::structurally_identifiable;
use augsim_robot::consistency::{BaseEstimate, nearest_consistent, raise_to_consistent};
use augsim_robot::{Numbers, regressor};
use std::f64::consts::PI;

/// Standard deviation of a combination that no free parameter changes, as a share of its size.
const FIXED_SHARE: f64 = 1e-3;
/// The same where the model has no covariance.
const UNKNOWN_SHARE: f64 = 1e-2;
/// Least mass of a link of the prior, as a share of the robot's mass.
const MIN_MASS_SHARE: f64 = 1e-6;
/// Least radius of gyration of a link of the prior, m.
const MIN_RADIUS_M: f64 = 1e-4;
/// Relative step of the derivatives. The combinations are polynomials of degree 3 in the parameters of a link.
const STEP: f64 = 1e-4;

/// Inertias of real bodies, and how well they agree with the identified combinations.
pub(super) struct Projection {
    /// Index of each link in the tree, with its ten parameters.
    pub links: Vec<(usize, [f64; 10])>,
    /// Squared deviation of the combinations in units of their covariance.
    pub chi_square: f64,
    /// Number of combinations.
    pub combinations: usize,
    /// Squared deviation that 95 % of the estimates of real bodies stay below.
    pub limit: f64,
    /// Whether the model has a covariance.
    pub has_covariance: bool,
}

/// Finds the inertias of real bodies nearest to the description file that keep the identified combinations.
///
/// The links with a mass in the file, and those of `changed`, may change.
///
/// # Errors
/// The covariance is not positive definite, or a value is not finite.
pub(super) fn project(model: &Model, robot: &RobotModel, changed: &[usize]) -> anyhow::Result<Projection> {
    let file = robot.tree.link_parameters(&robot.description);
    let total: f64 = file.iter().map(|p| p[0].max(0.0)).sum::<f64>().max(f64::MIN_POSITIVE);
    let is_variable = |k: &usize| file[*k][0] > 0.0 || changed.contains(k);
    let variable: Vec<usize> = (0..file.len()).filter(is_variable).collect();
    let prior = |k: &usize| raise_to_consistent(&file[*k], MIN_MASS_SHARE * total, MIN_RADIUS_M);
    let prior: Option<Vec<[f64; 10]>> = variable.iter().map(prior).collect();
    let prior = prior.context("the description file has an inertia that is not finite")?;
    let combinations = Combinations::new(model, robot);
    let covariance = combinations.covariance(model, &prior, &variable);
    let mut others = combinations.nominal.links.clone();
    variable.iter().for_each(|k| others[*k] = [0.0; 10]);
    let fixed = combinations.values(&others);
    let values =
        combinations.values(&combinations.nominal.links).into_iter().zip(fixed).map(|(all, f)| all - f);
    let row = |row: &Vec<f64>| variable.iter().flat_map(|k| row[10 * k..10 * k + 10].to_vec()).collect();
    let estimate = BaseEstimate {
        factors: combinations.factors.iter().map(row).collect(),
        values: values.collect(),
        covariance,
    };
    let found = nearest_consistent(&estimate, &prior)
        .context("the identified inertias are those of no real bodies, and none could be found near them")?;
    Ok(Projection {
        links: variable.into_iter().zip(found.parameters).collect(),
        chi_square: found.chi_square,
        combinations: estimate.values.len(),
        limit: chi_square_95(estimate.values.len()),
        has_covariance: model.covariance.is_some(),
    })
}

/// Combinations of the links' parameters that determine the torques.
struct Combinations {
    /// Factors, `[combination][10 * links]`.
    factors: Vec<Vec<f64>>,
    /// The robot at the nominal values of the model.
    nominal: RobotProperties,
}

impl Combinations {
    fn new(model: &Model, robot: &RobotModel) -> Self {
        let tree = &robot.tree;
        let links = robot.links.len();
        let nominal = model.robot_properties(&model.nominals());
        let nominal = nominal.unwrap_or(RobotProperties {
            links: vec![[0.0; 10]; links],
            armature: Vec::new(),
            gravity_m_s2: [0.0; 3],
        });
        let names = vec![String::new(); 10 * tree.bodies.len()];
        let gravity = nominal.gravity_m_s2;
        let base = structurally_identifiable(&names, &ranges(robot), |position, speed, acceleration| {
            regressor(&mut Numbers, tree, gravity, position, speed, acceleration).concat()
        });
        let bodies = base.factors();
        // Parameters of bodies are sums of those of their links, which are moved to the frame of the body.
        let mut factors = vec![vec![0.0; 10 * links]; bodies.len()];
        for column in 0..10 * links {
            let mut unit = vec![[0.0; 10]; links];
            unit[column / 10][column % 10] = 1.0;
            let moved: Vec<f64> = tree.body_parameters(&mut Numbers, &unit).concat();
            for (factor, body) in factors.iter_mut().zip(&bodies) {
                factor[column] = body.iter().zip(&moved).map(|(f, p)| f * p).sum();
            }
        }
        Combinations { factors, nominal }
    }

    /// Values of the combinations, `[combination]`.
    fn values(&self, links: &[[f64; 10]]) -> Vec<f64> {
        let parameters = links.concat();
        self.factors.iter().map(|row| row.iter().zip(&parameters).map(|(f, p)| f * p).sum()).collect()
    }

    /// Covariance of the combinations' values, `[combination][combination]`.
    ///
    /// Combinations that no parameter of the fit changes keep their values within a small share of their size.
    fn covariance(&self, model: &Model, prior: &[[f64; 10]], variable: &[usize]) -> Vec<Vec<f64>> {
        let count = self.factors.len();
        let mut covariance = vec![vec![0.0; count]; count];
        let share = if model.covariance.is_some() { FIXED_SHARE } else { UNKNOWN_SHARE };
        for (i, row) in self.factors.iter().enumerate() {
            let sizes = variable.iter().zip(prior).map(|(k, parameters)| {
                row[10 * k..10 * k + 10].iter().zip(parameters).map(|(f, p)| (f * p).abs()).sum::<f64>()
            });
            let size = sizes.sum::<f64>().max(f64::MIN_POSITIVE.sqrt());
            covariance[i][i] = (share * size).powi(2);
        }
        let Some(fitted) = &model.covariance else { return covariance };
        let derivatives: Vec<Vec<f64>> =
            fitted.parameters.iter().map(|parameter| self.derivative(model, *parameter)).collect();
        let is_inertial = |k: &usize| derivatives[*k].iter().any(|d| *d != 0.0) && fitted.rows[*k][*k] > 0.0;
        let inertial: Vec<usize> = (0..derivatives.len()).filter(is_inertial).collect();
        let conditional = conditional(&fitted.rows, &inertial);
        for (a, p) in inertial.iter().enumerate() {
            for (b, q) in inertial.iter().enumerate() {
                for (i, row) in covariance.iter_mut().enumerate() {
                    let left = derivatives[*p][i] * conditional[a][b];
                    row.iter_mut().zip(&derivatives[*q]).for_each(|(sum, right)| *sum += left * right);
                }
            }
        }
        covariance
    }

    /// Derivatives of the combinations with respect to a parameter of the model, `[combination]`.
    fn derivative(&self, model: &Model, parameter: usize) -> Vec<f64> {
        let nominal = model.nominals();
        let step = STEP * nominal[parameter].abs().max(1e-2);
        let at = |value: f64| {
            let mut values = nominal.clone();
            values[parameter] = value;
            let links = model.robot_properties(&values).map(|properties| properties.links);
            self.values(&links.unwrap_or_default())
        };
        let [high, low] = [nominal[parameter] + step, nominal[parameter] - step].map(at);
        high.iter().zip(low).map(|(high, low)| (high - low) / (2.0 * step)).collect()
    }
}

/// Covariance of some parameters while all others keep their values: the inverse of their part of the precision.
///
/// It is their part of the covariance if that of all parameters is singular.
fn conditional(rows: &[Vec<f64>], chosen: &[usize]) -> Vec<Vec<f64>> {
    let sd = |k: usize| rows[k][k].max(0.0).sqrt();
    let varied: Vec<usize> = (0..rows.len()).filter(|k| rows[*k][*k] > 0.0).collect();
    let correlation = Mat::from_fn(varied.len(), varied.len(), |i, j| {
        rows[varied[i]][varied[j]] / (sd(varied[i]) * sd(varied[j]))
    });
    let position = |k: &usize| varied.iter().position(|other| other == k);
    let places: Vec<usize> = chosen.iter().filter_map(position).collect();
    let inverse = invert_positive_definite(correlation).and_then(|precision| {
        let part = Mat::from_fn(places.len(), places.len(), |i, j| precision.inverse[(places[i], places[j])]);
        invert_positive_definite(part)
    });
    let element = |i: usize, j: usize| match &inverse {
        Some(inverse) => inverse.inverse[(i, j)] * sd(chosen[i]) * sd(chosen[j]),
        None => rows[chosen[i]][chosen[j]],
    };
    (0..chosen.len()).map(|i| (0..chosen.len()).map(|j| element(i, j)).collect()).collect()
}

/// 95 % quantile of the chi-square distribution (Wilson and Hilferty 1931), with an error below 1 % from 3 degrees of freedom.
fn chi_square_95(degrees: usize) -> f64 {
    let n = degrees.max(1) as f64;
    let share = 2.0 / (9.0 * n);
    n * (1.0 - share + 1.644_854 * share.sqrt()).powi(3)
}

/// Range of each coordinate: that of its joint, a whole turn, or 1 m to both sides.
fn ranges(robot: &RobotModel) -> Vec<[f64; 2]> {
    let of = |joint: usize| {
        let described = super::described_joint(robot, joint).map(|k| &robot.description.joints[k]);
        let whole = if robot.is_prismatic(joint) { [-1.0, 1.0] } else { [-PI, PI] };
        let range = described.and_then(|joint| joint.range);
        range.filter(|[low, high]| high > low && (high - low).is_finite()).unwrap_or(whole)
    };
    (0..robot.joints.len()).map(of).collect()
}
