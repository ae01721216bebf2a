//! A robot as a URDF file.

use std::fmt::Write as _;

use super::number::{comment, escape, number, numbers};
use super::urdf::inertial_element;
use crate::description::{Drive, Joint, JointKind, Placement, Robot};
use crate::rotation::{IDENTITY, about_axis, compose, to_roll_pitch_yaw};

/// Range and effort of a joint that has none; URDF demands both of prismatic joints.
const UNLIMITED: f64 = 1e9;

/// Writes a robot as a URDF file, which [`crate::read_urdf`] and other readers of URDF read.
///
/// A joint whose reference is not 0 is placed where it is at position 0. What URDF cannot state - gravity, armature, springs
/// and loops of drives - and elements that are not supported are listed in comments. A body of an MJCF file with several joints
/// has massless links between them, which MuJoCo's own reader of URDF refuses.
pub fn to_urdf(robot: &Robot) -> String {
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escape(&robot.name));
    let mut line = |indent: usize, xml: &str| {
        let _ = writeln!(text, "{}{xml}", "  ".repeat(indent));
    };
    line(1, &comment(&format!("Converted from {}.", robot.file)));
    for item in &robot.unsupported {
        line(1, &comment(&format!("Not converted: {} (line {}).", item.element, item.line)));
    }
    if let Some(gravity) = robot.gravity_m_s2 {
        line(1, &comment(&format!("Gravity: {} m/s2, which URDF cannot state.", numbers(&gravity))));
    }
    for link in &robot.links {
        let name = escape(&link.name);
        match &link.inertia {
            Some(inertia) => {
                line(1, &format!("<link name=\"{name}\">"));
                line(2, &inertial_element(inertia));
                line(1, "</link>");
            }
            None => line(1, &format!("<link name=\"{name}\"/>")),
        }
    }
    for joint in &robot.joints {
        for words in remarks(joint) {
            line(1, &comment(&words));
        }
        line(1, &format!("<joint name=\"{}\" type=\"{}\">", escape(&joint.name), joint_type(joint)));
        for xml in joint_content(robot, joint) {
            line(2, &xml);
        }
        line(1, "</joint>");
    }
    for xml in transmissions(robot) {
        line(1, &xml);
    }
    text.push_str("</robot>\n");
    text
}

/// Type of a joint in URDF; a revolute joint without limits is `continuous`.
fn joint_type(joint: &Joint) -> &'static str {
    match (joint.kind, joint.range) {
        (JointKind::Fixed, _) => "fixed",
        (JointKind::Prismatic, _) => "prismatic",
        (JointKind::Revolute, Some(_)) => "revolute",
        (JointKind::Revolute, None) => "continuous",
    }
}

/// What URDF cannot state of a joint.
fn remarks(joint: &Joint) -> Vec<String> {
    let values = [
        ("armature", joint.armature),
        ("stiffness", joint.stiffness),
        ("rest position of the spring", joint.spring_reference),
    ];
    let stated = values.iter().filter(|(_, value)| *value != 0.0);
    stated
        .map(|(quantity, value)| {
            format!("joint {}: {quantity} {}, which URDF cannot state", joint.name, number(*value))
        })
        .collect()
}

/// The elements of a joint.
fn joint_content(robot: &Robot, joint: &Joint) -> Vec<String> {
    let placement = placement_at_zero(joint);
    let mut content = vec![
        format!("<parent link=\"{}\"/>", escape(&robot.links[joint.parent].name)),
        format!("<child link=\"{}\"/>", escape(&robot.links[joint.child].name)),
        format!(
            "<origin xyz=\"{}\" rpy=\"{}\"/>",
            numbers(&placement.translation_m),
            numbers(&to_roll_pitch_yaw(&placement.rotation))
        ),
    ];
    if joint.kind == JointKind::Fixed {
        return content;
    }
    content.push(format!("<axis xyz=\"{}\"/>", numbers(&joint.axis)));
    let effort = joint.effort.unwrap_or(UNLIMITED);
    match (joint.kind, joint.range) {
        (JointKind::Revolute, None) if joint.effort.is_none() => {}
        (JointKind::Revolute, None) => content.push(limit(None, effort)),
        (_, range) => content.push(limit(Some(range.unwrap_or([-UNLIMITED, UNLIMITED])), effort)),
    }
    if joint.damping != 0.0 || joint.friction_loss != 0.0 {
        let (damping, friction) = (number(joint.damping), number(joint.friction_loss));
        content.push(format!("<dynamics damping=\"{damping}\" friction=\"{friction}\"/>"));
    }
    if let Some(coupling) = &joint.coupling {
        content.push(format!(
            "<mimic joint=\"{}\" multiplier=\"{}\" offset=\"{}\"/>",
            escape(&robot.joints[coupling.joint].name),
            number(coupling.ratio),
            number(coupling.offset)
        ));
    }
    content
}

/// A `<limit>`, without a largest speed.
fn limit(range: Option<[f64; 2]>, effort: f64) -> String {
    let bounds = range.map_or(String::new(), |[lower, upper]| {
        format!("lower=\"{}\" upper=\"{}\" ", number(lower), number(upper))
    });
    format!("<limit {bounds}effort=\"{}\" velocity=\"{}\"/>", number(effort), number(UNLIMITED))
}

/// Placement of the child frame at joint position 0.
fn placement_at_zero(joint: &Joint) -> Placement {
    let back = -joint.reference;
    let motion = match joint.kind {
        _ if back == 0.0 => return joint.placement,
        JointKind::Fixed => return joint.placement,
        JointKind::Revolute => Placement { rotation: about_axis(joint.axis, back), translation_m: [0.0; 3] },
        JointKind::Prismatic => Placement { rotation: IDENTITY, translation_m: joint.axis.map(|x| back * x) },
    };
    compose(&joint.placement, &motion)
}

/// Motors as transmissions; loops of drives as comments.
fn transmissions(robot: &Robot) -> Vec<String> {
    let write = |actuator: &crate::description::Actuator| {
        let joint = &robot.joints[actuator.joint].name;
        match actuator.drive {
            Drive::Motor => {
                let name = escape(&actuator.name);
                format!(
                    "<transmission name=\"{name}\"><type>transmission_interface/SimpleTransmission</type>\
                     <joint name=\"{}\"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>\
                     <actuator name=\"{name}\"><mechanicalReduction>{}</mechanicalReduction></actuator></transmission>",
                    escape(joint),
                    number(actuator.gear)
                )
            }
            Drive::Position { kp, kv } => {
                let gains = format!("kp {}, kv {}, gear {}", number(kp), number(kv), number(actuator.gear));
                comment(&format!("joint {joint}: position loop with {gains}, which URDF cannot state"))
            }
            Drive::Velocity { kv } => {
                let gains = format!("kv {}, gear {}", number(kv), number(actuator.gear));
                comment(&format!("joint {joint}: speed loop with {gains}, which URDF cannot state"))
            }
        }
    };
    robot.actuators.iter().map(write).collect()
}
