//! Models of robots from a description file and a joint log.
//!
//! The columns of the log are assigned to joints; for the inverse formulation the log is filtered, differentiated and
//! thinned out; and a model file with a section `[robot]` is written that the other commands take.

mod columns;
mod description_copy;
mod draft;
mod fault;
mod identifiable;
mod log;

use augsim_data::{Column, Dataset, Trajectory, Unit};
use augsim_equations::ColumnExpression;
use augsim_robot::Tree;
use augsim_robot::description::{Drive, JointKind, Robot, STANDARD_GRAVITY};
use augsim_robot::signals::Preparation;
use columns::JointColumns;
pub use description_copy::DescriptionCopy;
use draft::{Draft, DraftJoint};
pub use draft::{Formulation, Free};
pub use fault::RobotFault;
use log::JointLog;
use std::collections::BTreeMap;

/// What a model of a robot is made from.
#[derive(Debug, Clone)]
pub struct RobotRequest {
    /// Joints that move, in the order of the coordinates; empty for all joints that the log has positions of.
    pub joints: Vec<String>,
    /// Positions of joints as expressions of the log's columns: name of the joint and expression.
    pub positions: Vec<(String, String)>,
    /// Torques of joints as expressions of the log's columns: name of the joint and expression.
    pub torques: Vec<(String, String)>,
    /// Formulation; `None` for inverse where the log has torques, and forward where it has commands.
    pub formulation: Option<Formulation>,
    /// Acceleration of gravity in the frame of the base, m/s2; `None` for that of the file, or else standard gravity along -z.
    pub gravity: Option<[f64; 3]>,
    /// Properties of the robot that a fit may change.
    pub free: Free,
    /// Name of the description file beside the model file.
    pub file: String,
    /// Name of the log, for a comment in the model file.
    pub log: String,
}

/// A model of a robot with the data that it takes.
#[derive(Debug, Clone)]
pub struct RobotModel {
    /// Text of the model file.
    pub text: String,
    /// Columns of the model, from the log.
    pub data: Dataset,
    /// Names of the joints that move.
    pub joints: Vec<String>,
    /// Formulation of the model.
    pub formulation: Formulation,
    /// How the log was filtered; `None` in the forward formulation.
    pub preparation: Option<Preparation>,
    /// Names of the parameters of the robot that a fit may change.
    pub free: Vec<String>,
    /// What the user should know: unsupported elements of the file, warnings, unused trajectories.
    pub notes: Vec<String>,
}

/// Makes a model of a robot from its description and a joint log.
///
/// # Errors
/// A joint that the description lacks or that cannot move, columns of the log that cannot be assigned, a log that is too short
/// to filter.
pub fn model_from_robot(
    robot: &Robot,
    log: &Dataset,
    request: &RobotRequest,
) -> Result<RobotModel, RobotFault> {
    let names = moving_joints(robot, log, request)?;
    let signals = JointSignals::find(robot, log, &names, request)?;
    let formulation = signals.formulation(request)?;
    let tree = Tree::new(robot, &names, &BTreeMap::new())?;
    if formulation == Formulation::Forward {
        tree.check_inertia(robot)?;
    }
    let gravity = request.gravity.or(robot.gravity_m_s2).unwrap_or(STANDARD_GRAVITY);
    let mut notes = robot.warnings();
    notes.extend(unsupported(robot));
    let mut joints: Vec<DraftJoint<'_>> = Vec::new();
    for name in &names {
        let index = robot.joint(name).ok_or_else(|| RobotFault::unknown_joint(robot, name))?;
        joints.push(DraftJoint::new(&robot.joints[index]));
    }
    let (data, preparation) = match formulation {
        Formulation::Inverse => {
            let (data, preparation) = log::prepared(log, &signals.log(log, &names)?, &joints, &mut notes)?;
            (data, Some(preparation))
        }
        Formulation::Forward => (signals.forward_data(robot, log, &names, &mut joints, &mut notes)?, None),
    };
    let position = |joint: &DraftJoint<'_>| log::rms(&data, &joint.speed);
    let speeds: Vec<f64> = joints.iter().map(position).collect();
    joints.iter_mut().zip(speeds).for_each(|(joint, rms)| joint.speed_rms = rms);
    let properties = match formulation {
        Formulation::Inverse => {
            identifiable::properties(robot, &tree, &joints, &data, gravity, request.free)?
        }
        Formulation::Forward => identifiable::rotors(&joints, request.free),
    };
    let draft = Draft {
        preparation: preparation.clone(),
        robot,
        joints,
        formulation,
        gravity,
        free: request.free,
        properties,
        file: request.file.clone(),
        log: request.log.clone(),
    };
    let free = draft.properties.iter().map(|p| p.name.clone()).collect();
    Ok(RobotModel { text: draft.text(), data, joints: names, formulation, preparation, free, notes })
}

/// Number of joints of which a recording has both a position and a torque or current; at least two are a robot's log.
pub fn joints_in_log(columns: &[Column]) -> usize {
    // Names that no column contains, so that only numbers count.
    let joints: Vec<String> = (1..=columns.len()).map(|k| format!("\u{1}{k}")).collect();
    let assigned = columns::assign(columns, &joints);
    assigned
        .iter()
        .filter(|joint| joint.position.is_some() && (joint.torque.or(joint.current)).is_some())
        .count()
}

/// Describes the elements of the description file that are not supported.
fn unsupported(robot: &Robot) -> impl Iterator<Item = String> + '_ {
    robot
        .unsupported
        .iter()
        .map(|u| format!("{}, line {}: {} is not supported and is left out", robot.file, u.line, u.element))
}

/// Names of the joints that move: those of the request, or all that the log has positions of.
fn moving_joints(robot: &Robot, log: &Dataset, request: &RobotRequest) -> Result<Vec<String>, RobotFault> {
    if !request.joints.is_empty() {
        return Ok(request.joints.clone());
    }
    let is_free = |joint: &&augsim_robot::description::Joint| {
        joint.kind != JointKind::Fixed && joint.coupling.is_none()
    };
    let candidates: Vec<String> =
        robot.joints.iter().filter(is_free).map(|joint| joint.name.clone()).collect();
    let assigned = columns::assign(log.columns(), &candidates);
    let has_position = |(name, columns): &(&String, &JointColumns)| {
        columns.position.is_some() || request.positions.iter().any(|(joint, _)| joint == *name)
    };
    let found: Vec<String> =
        candidates.iter().zip(&assigned).filter(has_position).map(|(name, _)| name.clone()).collect();
    if found.is_empty() {
        let columns = log.columns().iter().map(|column| column.name().to_owned()).collect();
        return Err(RobotFault::NoPositions { joints: candidates, columns });
    }
    Ok(found)
}

/// Where the position, torque and command of each joint come from.
struct JointSignals {
    positions: Vec<ColumnExpression>,
    torques: Option<Vec<ColumnExpression>>,
    commands: Option<Vec<usize>>,
    /// Names of the columns with currents.
    currents: Vec<String>,
    /// Names of all columns of the log.
    columns: Vec<String>,
}

impl JointSignals {
    fn find(
        robot: &Robot,
        log: &Dataset,
        names: &[String],
        request: &RobotRequest,
    ) -> Result<Self, RobotFault> {
        let columns: Vec<String> = log.columns().iter().map(|column| column.name().to_owned()).collect();
        let assigned = columns::assign(log.columns(), names);
        for (name, _) in request.positions.iter().chain(&request.torques) {
            if !names.contains(name) {
                return Err(RobotFault::unknown_joint(robot, name));
            }
        }
        let expression = |given: &[(String, String)], option: &str, name: &String, column: Option<usize>| {
            let text = given.iter().find(|(joint, _)| joint == name).map(|(_, text)| text);
            let parse = |text: &str| ColumnExpression::parse(text, &columns, &format!("{option} {name}"));
            match (text, column) {
                (Some(text), _) => parse(text).map(Some),
                (None, Some(column)) => parse(&columns[column]).map(Some),
                (None, None) => Ok(None),
            }
        };
        let mut positions = Vec::new();
        let mut torques = Vec::new();
        for (name, found) in names.iter().zip(&assigned) {
            let position = expression(&request.positions, "--position", name, found.position)?;
            let missing = || RobotFault::NoPositions { joints: vec![name.clone()], columns: columns.clone() };
            positions.push(position.ok_or_else(missing)?);
            torques.push(expression(&request.torques, "--torque", name, found.torque)?);
        }
        let currents = assigned.iter().filter_map(|a| a.current).map(|i| columns[i].clone()).collect();
        Ok(Self {
            positions,
            torques: torques.into_iter().collect(),
            commands: assigned.iter().map(|a| a.command).collect(),
            currents,
            columns,
        })
    }

    /// The formulation of the request, or the one that the columns of the log allow.
    fn formulation(&self, request: &RobotRequest) -> Result<Formulation, RobotFault> {
        let no_torques =
            || RobotFault::NoTorques { currents: self.currents.clone(), columns: self.columns.clone() };
        match (request.formulation, &self.torques, &self.commands) {
            (Some(Formulation::Inverse) | None, Some(_), _) => Ok(Formulation::Inverse),
            (Some(Formulation::Inverse), None, _) => Err(no_torques()),
            (_, _, Some(_)) | (Some(Formulation::Forward), Some(_), _) => Ok(Formulation::Forward),
            _ => Err(no_torques()),
        }
    }

    /// The log of the joints, trajectory by trajectory.
    fn log(&self, log: &Dataset, names: &[String]) -> Result<Vec<JointLog>, RobotFault> {
        let Some(torques) = &self.torques else {
            return Err(RobotFault::NoTorques {
                currents: self.currents.clone(),
                columns: self.columns.clone(),
            });
        };
        let of = |t: &Trajectory| {
            let rows = |list: &[ColumnExpression]| -> Vec<Vec<f64>> {
                let row = |k: usize| list.iter().map(|e| e.at(&|column| t.column(column)[k])).collect();
                (0..t.len()).map(row).collect()
            };
            let log = augsim_robot::signals::Log {
                joints: names.to_vec(),
                time_s: t.time_s().to_vec(),
                position: rows(&self.positions),
                torque: rows(torques),
            };
            JointLog { trajectory: t.id().to_owned(), group: t.group().map(str::to_owned), log }
        };
        Ok(log.trajectories().iter().map(of).collect())
    }

    /// The data of the forward formulation: positions as measured, with the torques or commands as inputs.
    ///
    /// Trajectories in which a command or torque is missing are left out, with a note.
    fn forward_data(
        &self,
        robot: &Robot,
        log: &Dataset,
        names: &[String],
        joints: &mut [DraftJoint<'_>],
        notes: &mut Vec<String>,
    ) -> Result<Dataset, RobotFault> {
        let mut columns = Vec::new();
        let mut inputs: Vec<ColumnExpression> = Vec::new();
        for (index, joint) in joints.iter_mut().enumerate() {
            columns.push((format!("measured_{}", joint.position), joint.position_unit()));
            match (&self.commands, &self.torques) {
                (Some(commands), _) => {
                    let actuator =
                        robot.actuators.iter().find(|a| robot.joints[a.joint].name == names[index]);
                    let loop_of = actuator.map(|a| a.drive).filter(|drive| *drive != Drive::Motor);
                    let drive =
                        loop_of.ok_or_else(|| RobotFault::NoPositionLoop { joint: names[index].clone() })?;
                    let gear = actuator.map_or(1.0, |a| a.gear);
                    joint.command = Some((joint.command_name(drive), drive, gear));
                    let effort = joint.joint.effort.map(|effort| effort / gear.abs());
                    joint.limit = actuator.and_then(|a| a.force_range.map(|[_, high]| high)).or(effort);
                    let parsed =
                        ColumnExpression::parse(&self.columns[commands[index]], &self.columns, "command");
                    inputs.push(parsed?);
                }
                (None, Some(torques)) => inputs.push(torques[index].clone()),
                (None, None) => {
                    let currents = self.currents.clone();
                    return Err(RobotFault::NoTorques { currents, columns: self.columns.clone() });
                }
            }
        }
        for joint in joints.iter() {
            let speed = if joint.is_prismatic() { "m/s" } else { "rad/s" };
            columns.push(match &joint.command {
                Some((name, Drive::Velocity { .. }, _)) => (name.clone(), speed),
                Some((name, ..)) => (name.clone(), joint.position_unit()),
                None => (joint.torque_name(), joint.torque_unit()),
            });
        }
        let mut trajectories = Vec::new();
        let mut left_out = 0;
        for t in log.trajectories() {
            let series = |e: &ColumnExpression| -> Vec<f64> {
                (0..t.len()).map(|k| e.at(&|column| t.column(column)[k])).collect()
            };
            let outputs = self.positions.iter().map(series);
            let inputs: Vec<Vec<f64>> = inputs.iter().map(series).collect();
            if inputs.iter().flatten().any(|value| !value.is_finite()) {
                left_out += 1;
                continue;
            }
            let values: Vec<Vec<f64>> = outputs.chain(inputs).collect();
            trajectories.push(t.with_samples(t.time_s().to_vec(), values)?);
        }
        if left_out > 0 {
            notes.push(format!(
                "{left_out} of {} trajectories are left out, because the command or torque of a joint is missing in them",
                log.trajectories().len()
            ));
        }
        let column = |(name, unit): &(String, &str)| {
            Column::with_unit(name, Unit::parse(unit).unwrap_or(Unit::DIMENSIONLESS))
        };
        let columns = columns.iter().map(column).collect::<Result<Vec<Column>, _>>()?;
        Ok(Dataset::new(columns, trajectories)?)
    }
}
