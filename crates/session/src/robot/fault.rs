//! Errors of models of robots.

use augsim_data::{ColumnError, DataError, escaped_list, escaped_short};
use augsim_equations::ModelError;
use augsim_robot::Robot;
use augsim_robot::description::JointKind;
use augsim_robot::signals::SignalError;
use augsim_robot::tree::TreeError;
use thiserror::Error;

/// Why no model can be made from a robot's description and a log.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum RobotFault {
    /// The description has no such joint.
    #[error("{file} has no joint `{}` that can move; it has {}", escaped_short(joint), escaped_list(known))]
    UnknownJoint { file: String, joint: String, known: Vec<String> },
    /// The log has no position for a joint.
    #[error(
        "the log has no position of {}; its columns are {}; name one with --position, such as --position '{}=q1_rad'",
        escaped_list(joints), escaped_list(columns), joints.first().map_or("joint", String::as_str)
    )]
    NoPositions { joints: Vec<String>, columns: Vec<String> },
    /// The log has no torque or command for a joint.
    #[error(
        "the log has no torque of every joint{}; its columns are {}; give each with --torque, such as --torque 'joint_1=12.5 * current1_A'",
        if currents.is_empty() { "" } else { ", only currents, whose gains are not known" }, escaped_list(columns)
    )]
    NoTorques { currents: Vec<String>, columns: Vec<String> },
    /// A joint is commanded by position, but the description has no position loop for it.
    #[error(
        "the log has commanded positions of `{}`, but the description file has no position or velocity actuator for it; add one, or give its torque with --torque",
        escaped_short(joint)
    )]
    NoPositionLoop { joint: String },
    /// The log has no trajectories.
    #[error("the log has no trajectories")]
    EmptyLog,
    /// The log cannot be filtered.
    #[error("{file}: trajectory `{}`: {error}", escaped_short(trajectory))]
    Signals { file: String, trajectory: String, error: SignalError },
    #[error(transparent)]
    Tree(#[from] TreeError),
    #[error(transparent)]
    Expression(#[from] ModelError),
    #[error(transparent)]
    Data(#[from] DataError),
    #[error(transparent)]
    Column(#[from] ColumnError),
}

impl RobotFault {
    /// The error that a description has no joint of this name.
    pub(super) fn unknown_joint(robot: &Robot, name: &str) -> Self {
        let moving = robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
        RobotFault::UnknownJoint {
            file: robot.file.clone(),
            joint: name.to_owned(),
            known: moving.map(|joint| joint.name.clone()).collect(),
        }
    }
}
