//! Constraints of an MJCF file: couplings of two joints, and those that are not supported.

use super::body::{Bodies, Reach};
use super::classes::MAIN;
use crate::description::{Coupling, JointKind};
use crate::error::DescriptionError;
use crate::xml::Element;

/// Reads a constraint, when all bodies have been read.
pub(super) fn read(element: Element, bodies: &mut Bodies) -> Result<(), DescriptionError> {
    bodies.check_count(element)?;
    let class_is_active = bodies.classes.of(element, MAIN)?.is_active;
    if !bodies.settings.has_equality || !element.is_true("active")?.unwrap_or(class_is_active) {
        return Ok(());
    }
    if element.tag() == "joint" {
        return read_coupling(element, bodies);
    }
    let title = format!("equality {}", element.title());
    bodies.add_references(&title, element);
    Ok(())
}

/// Reads a coupling: y - y0 = c0 + c1 (x - x0) + ..., with the positions y of `joint1` and x of `joint2`, and their references.
fn read_coupling(element: Element, bodies: &mut Bodies) -> Result<(), DescriptionError> {
    let find = |attribute: &str| -> Result<Option<usize>, DescriptionError> {
        let Some(name) = element.attribute(attribute) else { return Ok(None) };
        bodies.robot.joint(name).map(Some).ok_or_else(|| {
            let problem = format!("equality {}: joint `{name}` does not exist", element.title());
            element.error(problem, "correct the name")
        })
    };
    element.required("joint1")?;
    let (follower, leader) = (find("joint1")?, find("joint2")?);
    let mut coefficients = [0.0, 1.0, 0.0, 0.0, 0.0];
    for (value, stated) in coefficients.iter_mut().zip(element.numbers("polycoef", 5)?.unwrap_or_default()) {
        *value = stated;
    }
    let Some(follower) = follower else { return Ok(()) };
    let joints = &bodies.robot.joints;
    let moves = |joint: usize| joints[joint].kind != JointKind::Fixed;
    let is_linear = coefficients[2..].iter().all(|coefficient| *coefficient == 0.0);
    match leader {
        Some(leader)
            if is_linear
                && moves(leader)
                && moves(follower)
                && joints[follower].coupling.is_none()
                && !depends_on(bodies, leader, follower) =>
        {
            let [constant, ratio, ..] = coefficients;
            let offset = joints[follower].reference + constant - ratio * joints[leader].reference;
            bodies.robot.joints[follower].coupling = Some(Coupling { joint: leader, ratio, offset });
        }
        _ => {
            let title = format!("equality {}", element.title());
            for joint in [Some(follower), leader].into_iter().flatten() {
                bodies.add_pending(title.clone(), element, Reach::Joint(joint));
            }
        }
    }
    Ok(())
}

/// Whether the position of a joint depends on that of another one by couplings that have been read.
fn depends_on(bodies: &Bodies, joint: usize, other: usize) -> bool {
    let couplings =
        |joint: &usize| bodies.robot.joints[*joint].coupling.as_ref().map(|coupling| coupling.joint);
    std::iter::successors(Some(joint), couplings).take(bodies.robot.joints.len()).any(|joint| joint == other)
}
