//! Transmissions of a URDF file, as motors with a gear ratio.

use crate::description::{Actuator, Drive, JointKind, Robot, Unsupported};
use crate::error::DescriptionError;
use crate::xml::Element;

/// Reads a transmission: a motor for each of its actuators.
///
/// A transmission of several joints, such as a differential, is listed as not supported.
pub(super) fn read(element: Element, robot: &mut Robot) -> Result<(), DescriptionError> {
    let title = element.title();
    let mut joints = Vec::new();
    for reference in element.children().filter(|child| child.tag() == "joint") {
        let name = reference.required("name")?;
        let Some(joint) = robot.joint(name) else {
            let element = format!("{title} of joint `{name}`, which does not exist");
            robot.unsupported.push(Unsupported { element, line: reference.line(), joints: Vec::new() });
            return Ok(());
        };
        joints.push((joint, reference));
    }
    let [(joint, reference)] = joints[..] else {
        if !joints.is_empty() {
            let joints = joints.iter().map(|(joint, _)| *joint).collect();
            robot.unsupported.push(Unsupported {
                element: format!("{title} of several joints"),
                line: element.line(),
                joints,
            });
        }
        return Ok(());
    };
    if robot.joints[joint].kind == JointKind::Fixed {
        let element_name = format!("{title} of joint `{}`, which does not move", robot.joints[joint].name);
        robot.unsupported.push(Unsupported {
            element: element_name,
            line: element.line(),
            joints: Vec::new(),
        });
        return Ok(());
    }
    let common = [reduction(reference)?, reduction(element)?];
    for motor in element.children().filter(|child| child.tag() == "actuator") {
        let name = motor.attribute("name").unwrap_or(&robot.joints[joint].name).to_owned();
        let gear = reduction(motor)?.or(common[0]).or(common[1]).unwrap_or(1.0);
        robot.actuators.push(Actuator {
            name,
            line: motor.line(),
            joint,
            drive: Drive::Motor,
            gear,
            command_range: None,
            force_range: None,
        });
    }
    Ok(())
}

/// Gear ratio in an element `mechanicalReduction`; `None` if there is none.
fn reduction(element: Element) -> Result<Option<f64>, DescriptionError> {
    let Some(child) = element.child("mechanicalReduction") else { return Ok(None) };
    let word = child.node().text().unwrap_or("").trim();
    match word.parse::<f64>() {
        Ok(ratio) if ratio.is_finite() && ratio != 0.0 => Ok(Some(ratio)),
        _ => {
            let problem = "mechanicalReduction is not a finite number other than 0";
            Err(child.error(problem, "write the gear ratio, such as 100"))
        }
    }
}
