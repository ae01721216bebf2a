//! Export of a robot's model as a description file: the user's own file with the identified values.
//!
//! Inertias of links, and damping, friction, rotor inertia and stiffness of joints, get the values of the model's parameters
//! and effects. What the format cannot state becomes a comment.

mod inertias;
mod joints;
mod projection;

#[cfg(test)]
mod tests;

use crate::Usage;
use crate::usage::ModelFault;
use augsim_equations::Model;
use augsim_equations::model::{RobotModel, plain_name};
use augsim_robot::description::{Format, Robot};
use augsim_robot::{Changes, read, to_mjcf, to_urdf, write_back};

/// Writes the description file of a model's robot with the model's values, in a format.
///
/// The user's own text is edited if the format is the same; otherwise the robot is converted.
///
/// # Errors
/// The model has no robot, or its values cannot be written into the file.
pub(super) fn description(model: &Model, format: Format) -> anyhow::Result<String> {
    let Some(robot) = &model.robot else {
        return Err(Usage::model(&model.file, ModelFault::NoRobotExported).into());
    };
    let mut changes = Changes::default();
    inertias::change(model, robot, &mut changes)?;
    joints::change(model, robot, &mut changes);
    let original = &robot.description;
    if original.format == format {
        return Ok(write_back(&robot.text, original, &changes)?);
    }
    let changed = changes.apply(original);
    let text = match format {
        Format::Urdf => to_urdf(&changed),
        Format::Mjcf => to_mjcf(&changed),
    };
    let converted = read(&text, &original.file)?;
    // The converted file states the new values already, and its joints may be in another order.
    let notes = changes
        .notes
        .into_iter()
        .filter_map(|(joint, note)| Some((converted.joint(&original.joints[joint].name)?, note)));
    let notes = Changes { notes: notes.collect(), ..Changes::default() };
    Ok(write_back(&text, &converted, &notes)?)
}

/// Index in the description of a joint of the model.
fn described_joint(robot: &RobotModel, joint: usize) -> Option<usize> {
    let name = &robot.joints.get(joint)?.name;
    robot.description.joints.iter().position(|described| plain_name(&described.name) == *name)
}

/// Index in the description of the joint before which notes on the whole robot are written: the first one of the model.
fn first_joint(robot: &RobotModel) -> usize {
    described_joint(robot, 0).unwrap_or(0)
}

/// Name of a link of the description.
fn link_name(robot: &Robot, link: usize) -> &str {
    robot.links.get(link).map_or("", |link| link.name.as_str())
}
