//! Identified values in the user's own description file, and conversions between the formats.

mod edits;
mod mjcf;
mod number;
mod to_mjcf;
mod to_urdf;
mod urdf;

pub use to_mjcf::to_mjcf;
pub use to_urdf::to_urdf;

use std::collections::{BTreeMap, BTreeSet};

use crate::description::{Format, Inertia, JointKind, Robot};
use crate::error::DescriptionError;
use crate::origins::Origins;
use crate::read::read_with_origins;
use crate::xml::{Element, Lines, parse};
use edits::Edits;

/// New values of a joint; `None` leaves a value as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointChange {
    /// Viscous friction, N m s/rad or N s/m.
    pub damping: Option<f64>,
    /// Coulomb friction, N m or N.
    pub friction_loss: Option<f64>,
    /// Inertia of the rotor, seen at the joint, kg m2 or kg.
    pub armature: Option<f64>,
    /// Stiffness of a spring in the joint, N m/rad or N/m.
    pub stiffness: Option<f64>,
}

/// New values of a robot.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// Index and inertia of each link that changes.
    pub inertias: Vec<(usize, Inertia)>,
    /// Index and values of each joint that changes.
    pub joints: Vec<(usize, JointChange)>,
    /// Index of a joint, and what the format cannot say of it.
    pub notes: Vec<(usize, String)>,
}

impl Changes {
    /// The robot with these changes; indices that it does not have are ignored.
    pub fn apply(&self, robot: &Robot) -> Robot {
        let mut changed = robot.clone();
        for (link, inertia) in &self.inertias {
            if let Some(link) = changed.links.get_mut(*link) {
                link.inertia = Some(*inertia);
            }
        }
        for (joint, change) in &self.joints {
            if let Some(joint) = changed.joints.get_mut(*joint) {
                joint.damping = change.damping.unwrap_or(joint.damping);
                joint.friction_loss = change.friction_loss.unwrap_or(joint.friction_loss);
                joint.armature = change.armature.unwrap_or(joint.armature);
                joint.stiffness = change.stiffness.unwrap_or(joint.stiffness);
            }
        }
        changed
    }
}

/// Puts new values into the text of a description file, whose comments, order and spacing stay.
///
/// `robot` is what `text` was read into. A URDF file gets a comment for an armature or a stiffness, which URDF cannot state.
///
/// # Errors
///
/// A text that was not read into `robot`, an index that the robot does not have, values that are not finite, a change of a
/// joint that does not move, and settings of an MJCF file that would change the values again when it is read.
pub fn write_back(text: &str, robot: &Robot, changes: &Changes) -> Result<String, DescriptionError> {
    let file = robot.file.as_str();
    let (original, origins) = read_with_origins(text, file)?;
    if names(&original) != names(robot) {
        let problem = "the file has other links and joints than the robot";
        return Err(DescriptionError::of_file(file, problem, "give the file that was read"));
    }
    check_changes(&original, changes)?;
    let document = parse(text, file)?;
    let lines = Lines::new(text);
    let root = Element::new(document.root_element(), file, &lines);
    let target = Target { robot: &original, elements: find_elements(root, &origins), root };
    let mut edits = Edits::new(text);
    match original.format {
        Format::Urdf => urdf::edit(&target, changes, &mut edits),
        Format::Mjcf => mjcf::edit(&target, changes, &mut edits)?,
    }
    for (joint, note) in &changes.notes {
        let child = original.joints[*joint].child;
        if let Some(element) = target.elements.joints[*joint].or(target.elements.links[child]) {
            edits.comment_before(element, &format!("joint {}: {note}", original.joints[*joint].name));
        }
    }
    let written = edits.apply();
    check_written(&written, &changes.apply(&original))?;
    Ok(written)
}

/// A file whose values are replaced.
struct Target<'a> {
    /// The robot that the file describes.
    robot: &'a Robot,
    /// Elements of its links and joints.
    elements: Elements<'a>,
    /// First element of the file.
    root: Element<'a>,
}

/// Elements of links and joints; `None` for those without an element of their own.
struct Elements<'a> {
    links: Vec<Option<Element<'a>>>,
    joints: Vec<Option<Element<'a>>>,
}

/// Names of the links and joints of a robot.
fn names(robot: &Robot) -> (Vec<&str>, Vec<&str>) {
    let links = robot.links.iter().map(|link| link.name.as_str());
    let joints = robot.joints.iter().map(|joint| joint.name.as_str());
    (links.collect(), joints.collect())
}

/// The elements that start at given positions.
fn find_elements<'a>(root: Element<'a>, origins: &Origins) -> Elements<'a> {
    let mut by_start = BTreeMap::new();
    let mut pending = vec![root];
    while let Some(element) = pending.pop() {
        by_start.insert(element.range().start, element);
        pending.extend(element.children());
    }
    let find = |starts: &[Option<usize>]| {
        starts.iter().map(|start| start.and_then(|start| by_start.get(&start).copied())).collect()
    };
    Elements { links: find(&origins.links), joints: find(&origins.joints) }
}

/// Refuses changes that the robot cannot have.
fn check_changes(robot: &Robot, changes: &Changes) -> Result<(), DescriptionError> {
    let refuse = |problem: String, remedy: &str| Err(DescriptionError::of_file(&robot.file, problem, remedy));
    for (k, inertia) in &changes.inertias {
        let Some(link) = robot.links.get(*k) else {
            return refuse(format!("the robot has no link {k}"), "give an index below the number of links");
        };
        let values = [inertia.mass_kg].into_iter().chain(inertia.centre_m).chain(inertia.inertia_kg_m2);
        if values.into_iter().any(|value| !value.is_finite()) {
            let problem = format!("the new inertia of link `{}` is not finite", link.name);
            return refuse(problem, "leave this link as it is");
        }
    }
    let joints = changes.joints.iter().map(|(k, _)| k).chain(changes.notes.iter().map(|(k, _)| k));
    if let Some(k) = joints.into_iter().find(|k| **k >= robot.joints.len()) {
        return refuse(format!("the robot has no joint {k}"), "give an index below the number of joints");
    }
    let links: BTreeSet<usize> = changes.inertias.iter().map(|(k, _)| *k).collect();
    let changed: BTreeSet<usize> = changes.joints.iter().map(|(k, _)| *k).collect();
    if links.len() < changes.inertias.len() || changed.len() < changes.joints.len() {
        return refuse("a link or a joint changes twice".into(), "give each one change");
    }
    for (k, change) in &changes.joints {
        let joint = &robot.joints[*k];
        let values = [change.damping, change.friction_loss, change.armature, change.stiffness];
        if values.iter().flatten().any(|value| !value.is_finite()) {
            return refuse(
                format!("a new value of joint `{}` is not finite", joint.name),
                "leave this joint as it is",
            );
        }
        if joint.kind == JointKind::Fixed && values.iter().any(Option::is_some) {
            return refuse(format!("joint `{}` does not move", joint.name), "leave this joint as it is");
        }
    }
    Ok(())
}

/// Refuses a text that does not give the changed robot when it is read.
fn check_written(text: &str, expected: &Robot) -> Result<(), DescriptionError> {
    let written = crate::read(text, &expected.file)?;
    let is_urdf = expected.format == Format::Urdf;
    let wrong_link = written.links.iter().zip(&expected.links).find(|(written, expected)| {
        // A massless base is written as one without inertia.
        let mass = |inertia: &Option<Inertia>| inertia.map_or([0.0; 10], |inertia| vector(&inertia));
        !is_close(&mass(&written.inertia), &mass(&expected.inertia))
    });
    let values = |joint: &crate::description::Joint| {
        let sayable = if is_urdf { 0.0 } else { 1.0 };
        [joint.damping, joint.friction_loss, sayable * joint.armature, sayable * joint.stiffness]
    };
    let wrong_joint = written
        .joints
        .iter()
        .zip(&expected.joints)
        .find(|(written, expected)| !is_close(&values(written), &values(expected)));
    let wrong = match (wrong_link, wrong_joint) {
        (None, None) => return Ok(()),
        (Some((_, link)), _) => format!("the inertia of link `{}`", link.name),
        (_, Some((_, joint))) => format!("the values of joint `{}`", joint.name),
    };
    let problem = format!("settings of the file change {wrong} when it is read");
    let remedy = "remove settotalmass, boundmass, boundinertia and balanceinertia from <compiler>";
    Err(DescriptionError::of_file(&expected.file, problem, remedy))
}

/// Mass, centre times mass, and tensor: the numbers that determine the motion.
fn vector(inertia: &Inertia) -> [f64; 10] {
    let Inertia { mass_kg, centre_m: [x, y, z], inertia_kg_m2: [a, b, c, d, e, f] } = *inertia;
    [mass_kg, mass_kg * x, mass_kg * y, mass_kg * z, a, b, c, d, e, f]
}

/// Whether two lists agree within the rounding of sums and rotations, relative to their largest number.
fn is_close(a: &[f64], b: &[f64]) -> bool {
    const RELATIVE: f64 = 1e-10;
    let largest = a.iter().chain(b).fold(0.0_f64, |largest, value| largest.max(value.abs()));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= RELATIVE * largest)
}
