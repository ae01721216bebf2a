//! Actuators of an MJCF file.
//!
//! All types are shorthands of `general`: force = gain * command + bias, with a constant gain and
//! bias = b0 + b1 * length + b2 * speed, where length = gear * joint position.

use super::actuator_values::Activation;
use super::body::{Bodies, Reach};
use super::classes::MAIN;
use crate::description::{Actuator, Drive, JointKind};
use crate::error::DescriptionError;
use crate::structure::subtree_inertia;
use crate::xml::Element;

/// Reads an actuator, when all bodies have been read.
pub(super) fn read(element: Element, bodies: &mut Bodies) -> Result<(), DescriptionError> {
    bodies.check_count(element)?;
    let title = format!("actuator {}", element.title());
    let Some(name) = element.attribute("joint").or(element.attribute("jointinparent")) else {
        bodies.add_pending(format!("{title}, which moves no joint directly"), element, Reach::Above(0));
        return Ok(());
    };
    let Some(joint) = bodies.robot.joint(name) else {
        let problem = format!("{}: its joint `{name}` does not exist", element.title());
        return Err(element.error(problem, "correct the name"));
    };
    let mut values = bodies.classes.of(element, MAIN)?.actuator.clone();
    values.apply(element)?;
    let is_supported = matches!(element.tag(), "motor" | "position" | "velocity" | "general")
        && bodies.robot.joints[joint].kind != JointKind::Fixed;
    let drive = match is_supported && values.gear != 0.0 {
        true => values.drive(|| subtree_inertia(&bodies.robot, joint)),
        false => None,
    };
    let Some(drive) = drive else {
        bodies.add_pending(format!("{title} of joint `{name}`"), element, Reach::Above(0));
        return Ok(());
    };
    if values.activation == Activation::Filter {
        let element_name =
            format!("filter of the command of {title} (time constant {} s)", values.time_constant);
        bodies.add_pending(element_name, element, Reach::Above(0));
    }
    let mut command_range =
        values.command_limited.limit(values.command_range, "ctrlrange", element, bodies.settings)?;
    if values.inherited_range > 0.0 && matches!(drive, Drive::Position { .. }) {
        let Some([low, high]) = bodies.robot.joints[joint].range else {
            let problem = format!("{} inherits the range of joint `{name}`, which has none", element.title());
            return Err(element.error(problem, "give the joint a range, or remove inheritrange"));
        };
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0 * values.inherited_range);
        command_range = Some([middle - half, middle + half]);
    }
    let force_range =
        values.force_limited.limit(values.force_range, "forcerange", element, bodies.settings)?;
    // The gain of a motor counts as part of its gear.
    let gain = if drive == Drive::Motor { values.gain } else { 1.0 };
    let force_range = force_range.map(|[low, high]| {
        let [a, b] = [low / gain, high / gain];
        [a.min(b), a.max(b)]
    });
    bodies.robot.actuators.push(Actuator {
        name: element.attribute("name").unwrap_or(name).into(),
        line: element.line(),
        joint,
        drive,
        gear: values.gear * gain,
        command_range,
        force_range,
    });
    Ok(())
}
