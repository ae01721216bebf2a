//! Chooses the inertial parameters of a robot that a log can identify.
//!
//! Torques are linear in the inertial parameters, but only some combinations of them move the torques at all, and a log
//! excites only some of these (base parameters: Gautier, "Numerical calculation of the base inertial parameters of robots",
//! ICRA 1990). The parameters are taken from the base to the tip, and one is free if its column of the regressor is not a
//! combination of those before it, and if the log determines it better than within the size of the whole robot. Each free
//! parameter then stands for a combination; all others keep the values of the description file.

use super::draft::{DraftJoint, Free, FreeParameter};
use super::fault::RobotFault;
use augsim_data::Dataset;
use augsim_equations::model::{LINEAR_ENDINGS, plain_name};
use augsim_robot::base_parameters::{BaseParameters, Independence, base_parameters};
use augsim_robot::description::Robot;
use augsim_robot::triangular_factor::TriangularFactor;
use augsim_robot::{Numbers, Tree, regressor};

/// Number of samples of the log from which the columns of the regressor are computed.
const ROWS: usize = 600;
/// Share of a column that must lie outside the columns before it; below this the remainder is rounding.
const INDEPENDENT_SHARE: f64 = 1e-7;
/// Standard errors that must fit into the size of the robot.
const STANDARD_ERRORS: f64 = 2.0;

/// A column of the regressor, stacked over the samples and joints.
struct RegressorColumn {
    /// Values, each divided by the root mean square of its joint's torque.
    values: Vec<f64>,
    /// Free parameter that the column belongs to, with the size of the robot in its unit; `None` for friction and offsets.
    parameter: Option<(FreeParameter, f64)>,
}

/// The rotor inertias, where they are free.
pub(super) fn rotors(joints: &[DraftJoint<'_>], free: Free) -> Vec<FreeParameter> {
    joints.iter().filter(|_| free.armature).map(armature).collect()
}

fn armature(joint: &DraftJoint<'_>) -> FreeParameter {
    let unit = if joint.is_prismatic() { "kg" } else { "kg_m2" };
    FreeParameter {
        name: format!("{}_armature_{unit}", joint.name),
        nominal: joint.joint.armature,
        is_positive: true,
    }
}

/// The inertial parameters and rotor inertias that the data, in the columns of the joints, can identify.
pub(super) fn properties(
    robot: &Robot,
    tree: &Tree,
    joints: &[DraftJoint<'_>],
    data: &Dataset,
    gravity: [f64; 3],
    free: Free,
) -> Result<Vec<FreeParameter>, RobotFault> {
    if !free.inertias {
        return Ok(rotors(joints, free));
    }
    let rows = Rows::sample(data, joints)?;
    let mut columns = friction_columns(&rows, joints.len());
    if free.armature {
        columns.extend(rotor_columns(&rows, joints));
    }
    columns.extend(inertial_columns(robot, tree, &rows, gravity));
    let noise = residual(&columns, &rows.torque);
    Ok(independent(columns, noise))
}

/// Motions and torques at samples of the log.
struct Rows {
    /// Position, speed and acceleration of every joint, `[row][joint]`.
    position: Vec<Vec<f64>>,
    speed: Vec<Vec<f64>>,
    acceleration: Vec<Vec<f64>>,
    /// Torques, each divided by the root mean square of its joint, `[row * joints + joint]`.
    torque: Vec<f64>,
    /// One over the root mean square of each joint's torque.
    weights: Vec<f64>,
}

impl Rows {
    fn sample(data: &Dataset, joints: &[DraftJoint<'_>]) -> Result<Rows, RobotFault> {
        let total: usize = data.trajectories().iter().map(|t| t.len()).sum();
        let stride = total.div_ceil(ROWS).max(1);
        let column = |name: &str| -> Result<Vec<f64>, RobotFault> {
            Ok(data.series(name)?.flatten().copied().step_by(stride).collect())
        };
        let all = |of: &dyn Fn(&DraftJoint<'_>) -> String| -> Result<Vec<Vec<f64>>, RobotFault> {
            let columns = joints.iter().map(|joint| column(&of(joint))).collect::<Result<Vec<_>, _>>()?;
            let count = columns.first().map_or(0, Vec::len);
            Ok((0..count).map(|k| columns.iter().map(|values| values[k]).collect()).collect())
        };
        let torque = all(&|joint| joint.torque_name())?;
        let weight = |joint: usize| {
            let squares: f64 = torque.iter().map(|row| row[joint] * row[joint]).sum();
            let rms = (squares / torque.len().max(1) as f64).sqrt();
            if rms > 0.0 { 1.0 / rms } else { 1.0 }
        };
        let weights: Vec<f64> = (0..joints.len()).map(weight).collect();
        Ok(Rows {
            position: all(&|joint| joint.position.clone())?,
            speed: all(&|joint| joint.speed.clone())?,
            acceleration: all(&|joint| joint.acceleration.clone())?,
            torque: torque.iter().flat_map(|row| row.iter().zip(&weights).map(|(t, w)| t * w)).collect(),
            weights,
        })
    }

    /// A column whose value in a row and joint is `value(row, joint)`.
    fn column(&self, value: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let joints = self.weights.len();
        (0..self.position.len() * joints)
            .map(|i| self.weights[i % joints] * value(i / joints, i % joints))
            .collect()
    }
}

/// Columns of viscous friction, Coulomb friction and offset of each joint, which no inertial parameter may replace.
fn friction_columns(rows: &Rows, joints: usize) -> Vec<RegressorColumn> {
    let of_joint = |joint: usize| {
        let at = move |value: f64, other: usize| if other == joint { value } else { 0.0 };
        [
            rows.column(|row, other| at(rows.speed[row][joint], other)),
            rows.column(|row, other| at(rows.speed[row][joint].signum(), other)),
            rows.column(|_, other| at(1.0, other)),
        ]
    };
    (0..joints).flat_map(of_joint).map(|values| RegressorColumn { values, parameter: None }).collect()
}

fn rotor_columns(rows: &Rows, joints: &[DraftJoint<'_>]) -> Vec<RegressorColumn> {
    let of = |(index, joint): (usize, &DraftJoint<'_>)| RegressorColumn {
        values: rows.column(|row, other| if other == index { rows.acceleration[row][index] } else { 0.0 }),
        // A rotor's inertia is positive and has no typical size: it is free wherever its column is independent.
        parameter: Some((armature(joint), f64::INFINITY)),
    };
    joints.iter().enumerate().map(of).collect()
}

/// Columns of the inertial parameters of the bodies, from the base to the tip.
fn inertial_columns(robot: &Robot, tree: &Tree, rows: &Rows, gravity: [f64; 3]) -> Vec<RegressorColumn> {
    let file = tree.link_parameters(robot);
    let mass: f64 = file.iter().map(|p| p[0]).sum::<f64>().max(f64::MIN_POSITIVE);
    let length =
        |p: &augsim_robot::tree::Body| p.placement.translation_m.iter().map(|x| x * x).sum::<f64>().sqrt();
    let reach = tree.bodies.iter().map(length).sum::<f64>().max(0.1);
    let matrices: Vec<Vec<Vec<f64>>> = (0..rows.position.len())
        .map(|row| {
            let (q, w, a) = (&rows.position[row], &rows.speed[row], &rows.acceleration[row]);
            regressor(&mut Numbers, tree, gravity, q, w, a)
        })
        .collect();
    let mut columns = Vec::new();
    for body in 0..tree.bodies.len() {
        let Some(link) = tree.links.iter().position(|attached| attached.body == body) else { continue };
        let name = plain_name(&robot.links[tree.links[link].link].name);
        // The mass comes last: it is hardly ever identifiable by itself.
        for k in (1..10).chain([0]) {
            let ending = LINEAR_ENDINGS[k];
            let size = match k {
                0 => mass,
                1..=3 => mass * reach,
                _ => mass * reach * reach,
            };
            let parameter = FreeParameter {
                name: format!("{name}_{ending}"),
                nominal: file[link][k],
                is_positive: k == 0,
            };
            columns.push(RegressorColumn {
                values: rows.column(|row, joint| matrices[row][joint][10 * body + k]),
                parameter: Some((parameter, size)),
            });
        }
    }
    columns
}

/// Root mean square of what all columns together leave of the torques.
fn residual(columns: &[RegressorColumn], torque: &[f64]) -> f64 {
    let all = columns.iter().map(|column| &column.values[..]);
    let base = base(all, &Independence::Share(INDEPENDENT_SHARE));
    let independent = base.independent.iter().map(|k| &columns[*k].values[..]);
    let factor = factor(independent.chain([torque]));
    let degrees = torque.len().saturating_sub(base.independent.len()).max(1);
    // The last element of the factor is the norm of the part of the torques that no column explains.
    let rest = factor.upper().last().copied().unwrap_or(0.0);
    rest.abs() / (degrees as f64).sqrt()
}

/// The parameters whose columns are independent of those before them and that the noise leaves visible.
fn independent(columns: Vec<RegressorColumn>, noise: f64) -> Vec<FreeParameter> {
    let size = |column: &RegressorColumn| column.parameter.as_ref().map_or(f64::INFINITY, |(_, size)| *size);
    let visible = Independence::Noise {
        torque_sd: STANDARD_ERRORS * noise,
        plausible: columns.iter().map(size).collect(),
    };
    let base = base(columns.iter().map(|column| &column.values[..]), &visible);
    let mut parameters: Vec<_> = columns.into_iter().map(|column| column.parameter).collect();
    base.independent.iter().filter_map(|k| parameters[*k].take()).map(|(parameter, _)| parameter).collect()
}

/// Which of these columns are independent of those before them.
fn base<'v>(columns: impl Iterator<Item = &'v [f64]>, independence: &Independence) -> BaseParameters {
    let factor = factor(columns);
    base_parameters(&factor, &vec![String::new(); factor.width()], independence)
}

/// Triangular factor of a matrix with these columns.
fn factor<'v>(columns: impl Iterator<Item = &'v [f64]>) -> TriangularFactor {
    let columns: Vec<&[f64]> = columns.collect();
    let mut factor = TriangularFactor::new(columns.len());
    for row in 0..columns.first().map_or(0, |column| column.len()) {
        factor.add_rows(&columns.iter().map(|column| column[row]).collect::<Vec<f64>>());
    }
    factor
}
