//! Joints of a URDF file.

use std::collections::BTreeMap;

use super::read_origin;
use crate::description::{Coupling, Joint, JointKind, Placement, Robot, Unsupported};
use crate::error::DescriptionError;
use crate::rotation::normalize;
use crate::structure::{check_count, unsupported_joint};
use crate::xml::Element;

/// Reads the joints, whose links have been read.
pub(super) fn read_joints(elements: &[Element], robot: &mut Robot) -> Result<(), DescriptionError> {
    let links: BTreeMap<String, usize> =
        robot.links.iter().enumerate().map(|(k, link)| (link.name.clone(), k)).collect();
    for element in elements {
        robot.joints.push(read_joint(*element, &links)?);
        check_count(robot)?;
    }
    let joints: BTreeMap<String, usize> =
        robot.joints.iter().enumerate().map(|(k, joint)| (joint.name.clone(), k)).collect();
    for (k, element) in elements.iter().enumerate() {
        if let Some(mimic) = element.child("mimic") {
            read_mimic(mimic, k, &joints, robot)?;
        }
    }
    Ok(())
}

/// Lists joints of the types `floating` and `planar` as not supported; the joints form a tree.
pub(super) fn list_unsupported_types(elements: &[Element], robot: &mut Robot) {
    for (k, element) in elements.iter().enumerate() {
        if let Some(kind @ ("floating" | "planar")) = element.attribute("type") {
            let name = format!("{kind} joint `{}`", robot.joints[k].name);
            robot.unsupported.push(unsupported_joint(robot, k, name));
        }
    }
}

/// Reads a joint, apart from its coupling.
fn read_joint(element: Element, links: &BTreeMap<String, usize>) -> Result<Joint, DescriptionError> {
    let name = element.required("name")?;
    let declared_type = element.required("type")?;
    let kind = match declared_type {
        "revolute" | "continuous" => JointKind::Revolute,
        "prismatic" => JointKind::Prismatic,
        "fixed" | "floating" | "planar" => JointKind::Fixed,
        other => {
            let problem = format!("joint `{name}` has the unknown type `{other}`");
            return Err(element.error(problem, "use revolute, continuous, prismatic or fixed"));
        }
    };
    let (rotation, translation_m) = read_origin(element)?;
    let (range, effort) = read_limits(name, element, declared_type)?;
    let dynamics = element.child("dynamics");
    let friction = |attribute: &str| match dynamics {
        Some(dynamics) => dynamics.number(attribute).map(|value| value.unwrap_or(0.0)),
        None => Ok(0.0),
    };
    Ok(Joint {
        name: name.into(),
        line: element.line(),
        kind,
        parent: find_link(name, element, "parent", links)?,
        child: find_link(name, element, "child", links)?,
        placement: Placement { rotation, translation_m },
        axis: if kind == JointKind::Fixed { [1.0, 0.0, 0.0] } else { read_axis(name, element)? },
        reference: 0.0,
        range,
        effort,
        damping: friction("damping")?,
        friction_loss: friction("friction")?,
        armature: 0.0,
        stiffness: 0.0,
        spring_reference: 0.0,
        coupling: None,
    })
}

/// Index of the parent or child link of a joint.
fn find_link(
    joint: &str,
    element: Element,
    role: &str,
    links: &BTreeMap<String, usize>,
) -> Result<usize, DescriptionError> {
    let Some(reference) = element.child(role) else {
        let problem = format!("joint `{joint}` has no <{role}>");
        return Err(element.error(problem, format!("add <{role} link=\"...\"/>")));
    };
    let link = reference.required("link")?;
    links.get(link).copied().ok_or_else(|| {
        let problem = format!("joint `{joint}`: its {role} link `{link}` does not exist");
        reference.error(problem, format!("declare <link name=\"{link}\"/> or correct the name"))
    })
}

/// Axis of a joint, of length 1; the x axis where the file states none.
fn read_axis(joint: &str, element: Element) -> Result<[f64; 3], DescriptionError> {
    let Some(axis) = element.child("axis") else { return Ok([1.0, 0.0, 0.0]) };
    let vector = axis.vector::<3>("xyz")?.unwrap_or([1.0, 0.0, 0.0]);
    normalize(vector).ok_or_else(|| {
        axis.error(
            format!("joint `{joint}`: <axis> has the length 0"),
            "give a direction, such as xyz=\"0 0 1\"",
        )
    })
}

/// Range of positions, and largest torque or force, of a joint.
type Limits = (Option<[f64; 2]>, Option<f64>);

/// Reads the limits of a joint. A bound that is missing beside the other one is 0; a continuous joint has no bounds.
///
/// Exporters of CAD programs write zeros where the user entered nothing: an empty range and an effort of 0 count as not stated.
fn read_limits(joint: &str, element: Element, declared_type: &str) -> Result<Limits, DescriptionError> {
    let Some(limit) = element.child("limit") else { return Ok((None, None)) };
    let bounds = (limit.number("lower")?, limit.number("upper")?);
    let effort = limit.number("effort")?.filter(|effort| *effort > 0.0);
    if bounds == (None, None) || !matches!(declared_type, "revolute" | "prismatic") {
        return Ok((None, effort));
    }
    let [lower, upper] = [bounds.0.unwrap_or(0.0), bounds.1.unwrap_or(0.0)];
    if lower > upper {
        let problem = format!("joint `{joint}`: its lower limit {lower} exceeds its upper limit {upper}");
        return Err(limit.error(problem, "swap them"));
    }
    Ok(((lower < upper).then_some([lower, upper]), effort))
}

/// Reads the coupling of a joint to another one.
fn read_mimic(
    mimic: Element,
    joint: usize,
    joints: &BTreeMap<String, usize>,
    robot: &mut Robot,
) -> Result<(), DescriptionError> {
    let name = robot.joints[joint].name.clone();
    let target = mimic.required("joint")?;
    let Some(&leader) = joints.get(target) else {
        let problem = format!("joint `{name}` mimics joint `{target}`, which does not exist");
        return Err(mimic.error(problem, "correct the name"));
    };
    let coupling = Coupling {
        joint: leader,
        ratio: mimic.number("multiplier")?.unwrap_or(1.0),
        offset: mimic.number("offset")?.unwrap_or(0.0),
    };
    let is_fixed = |k: usize| robot.joints[k].kind == JointKind::Fixed;
    if is_fixed(joint) || is_fixed(leader) {
        let element = format!("mimic of joint `{name}` and joint `{target}`, of which one does not move");
        robot.unsupported.push(Unsupported { element, line: mimic.line(), joints: vec![joint] });
    } else {
        robot.joints[joint].coupling = Some(coupling);
    }
    Ok(())
}
