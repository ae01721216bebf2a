//! What every description must satisfy: links that joints connect to one tree, and masses that a body can have.

use std::collections::BTreeMap;

use crate::description::{Drive, Inertia, Joint, JointKind, Placement, Robot, Unsupported};
use crate::error::DescriptionError;
use crate::rotation::{add, apply, compose, dot, rotate_tensor, tensor};

/// Largest number of links.
const MAX_LINKS: usize = 2_000;
/// Largest number of joints between a link and the base.
const MAX_CHAIN: usize = 200;
/// Largest number of elements that are listed as not supported.
const MAX_UNSUPPORTED: usize = 1_000;

/// Refuses robots that are no tree, or that have links that no body can be.
pub(crate) fn check(robot: &Robot) -> Result<(), DescriptionError> {
    check_count(robot)?;
    check_names(robot)?;
    check_tree(robot)?;
    check_couplings(robot)?;
    check_finite(robot)?;
    check_masses(robot)?;
    if robot.unsupported.len() > MAX_UNSUPPORTED {
        let problem = format!("the file has more than {MAX_UNSUPPORTED} elements that are not supported");
        return Err(DescriptionError::of_file(
            &robot.file,
            problem,
            "remove those that do not concern the robot",
        ));
    }
    Ok(())
}

/// Refuses too many links, joints or actuators.
pub(crate) fn check_count(robot: &Robot) -> Result<(), DescriptionError> {
    if robot.links.len() > MAX_LINKS {
        let problem = format!("the robot has more than {MAX_LINKS} links");
        return Err(DescriptionError::of_file(&robot.file, problem, "split it into parts"));
    }
    if robot.joints.len().max(robot.actuators.len()) > MAX_LINKS {
        let problem = format!("the robot has more than {MAX_LINKS} joints or actuators");
        return Err(DescriptionError::of_file(&robot.file, problem, "split it into parts"));
    }
    Ok(())
}

/// Refuses two links or two joints of the same name.
fn check_names(robot: &Robot) -> Result<(), DescriptionError> {
    let links = robot.links.iter().map(|link| (link.name.as_str(), link.line));
    let joints = robot.joints.iter().map(|joint| (joint.name.as_str(), joint.line));
    check_unique(robot, "link", links)?;
    check_unique(robot, "joint", joints)
}

/// Refuses two elements of the same kind and name.
fn check_unique<'r>(
    robot: &Robot,
    kind: &str,
    named: impl Iterator<Item = (&'r str, usize)>,
) -> Result<(), DescriptionError> {
    let mut lines = BTreeMap::new();
    for (name, line) in named {
        if let Some(first) = lines.insert(name, line) {
            let problem = format!("{kind} `{name}` is declared a second time (first in line {first})");
            return Err(DescriptionError::at(&robot.file, line, problem, "give it another name"));
        }
    }
    Ok(())
}

/// Refuses links with two parents, loops, several bases, and chains that are too long.
fn check_tree(robot: &Robot) -> Result<(), DescriptionError> {
    let mut parents: Vec<Option<usize>> = vec![None; robot.links.len()];
    for (k, joint) in robot.joints.iter().enumerate() {
        if let Some(first) = parents[joint.child].replace(k) {
            let first = &robot.joints[first];
            let problem = format!(
                "link `{}` is the child of two joints, `{}` (line {}) and `{}`",
                robot.links[joint.child].name, first.name, first.line, joint.name
            );
            return Err(DescriptionError::at(&robot.file, joint.line, problem, "remove one of the joints"));
        }
    }
    let mut roots = (0..robot.links.len()).filter(|link| parents[*link].is_none());
    let first = roots.next();
    if let (Some(first), Some(second)) = (first, roots.next()) {
        let (first, second) = (&robot.links[first], &robot.links[second]);
        let problem = format!(
            "the robot has two base links, `{}` (line {}) and `{}`: no joint has either as its child",
            first.name, first.line, second.name
        );
        return Err(DescriptionError::at(&robot.file, second.line, problem, "connect them by a joint"));
    }
    if robot.links.is_empty() {
        return Err(DescriptionError::of_file(&robot.file, "the robot has no link", "declare its links"));
    }
    check_chains(robot, &parents)
}

/// Refuses joints that form a loop, and chains that are too long.
fn check_chains(robot: &Robot, parents: &[Option<usize>]) -> Result<(), DescriptionError> {
    for link in 0..robot.links.len() {
        let mut visited = Vec::new();
        let mut current = link;
        while let Some(joint) = parents[current] {
            if let Some(start) = visited.iter().position(|earlier| *earlier == joint) {
                let loop_joints = &visited[start..];
                let line = robot.joints[joint].line;
                let problem = format!("{} form a loop", list_joints(robot, loop_joints));
                return Err(DescriptionError::at(
                    &robot.file,
                    line,
                    problem,
                    "remove one of them: a robot is a tree",
                ));
            }
            if visited.len() == MAX_CHAIN {
                let line = robot.links[link].line;
                let problem = format!(
                    "link `{}` is more than {MAX_CHAIN} joints away from the base",
                    robot.links[link].name
                );
                return Err(DescriptionError::at(&robot.file, line, problem, "split the robot into parts"));
            }
            visited.push(joint);
            current = robot.joints[joint].parent;
        }
    }
    Ok(())
}

/// Names of joints for a message; at most six.
fn list_joints(robot: &Robot, joints: &[usize]) -> String {
    const MAX_SHOWN: usize = 6;
    let shown: Vec<String> =
        joints.iter().take(MAX_SHOWN).map(|joint| format!("`{}`", robot.joints[*joint].name)).collect();
    let more = if joints.len() > MAX_SHOWN { " and others" } else { "" };
    let noun = if joints.len() == 1 { "joint" } else { "joints" };
    format!("{noun} {}{more}", shown.join(", "))
}

/// Refuses joints whose couplings form a loop.
fn check_couplings(robot: &Robot) -> Result<(), DescriptionError> {
    for start in 0..robot.joints.len() {
        let mut chain = vec![start];
        let mut current = start;
        while let Some(coupling) = &robot.joints[current].coupling {
            current = coupling.joint;
            if let Some(first) = chain.iter().position(|joint| *joint == current) {
                let problem =
                    format!("the positions of {} depend on each other", list_joints(robot, &chain[first..]));
                let line = robot.joints[current].line;
                let remedy = "let one of them be independent";
                return Err(DescriptionError::at(&robot.file, line, problem, remedy));
            }
            if chain.len() > MAX_CHAIN {
                let line = robot.joints[start].line;
                let problem = format!("joint `{}` depends on a chain of couplings", robot.joints[start].name);
                let remedy = "couple it with the independent joint";
                return Err(DescriptionError::at(&robot.file, line, problem, remedy));
            }
            chain.push(current);
        }
    }
    Ok(())
}

/// Refuses numbers that the arithmetic of the reader made infinite, such as the mass of a geom of 1e200 m.
fn check_finite(robot: &Robot) -> Result<(), DescriptionError> {
    let refuse = |line: usize, name: &str, kind: &str| {
        let problem = format!("{kind} `{name}` has numbers that are too large");
        Err(DescriptionError::at(&robot.file, line, problem, "check their units"))
    };
    for link in &robot.links {
        let inertia = link.inertia.map_or([0.0; 10], |inertia| {
            let Inertia { mass_kg, centre_m: [x, y, z], inertia_kg_m2: [a, b, c, d, e, f] } = inertia;
            [mass_kg, x, y, z, a, b, c, d, e, f]
        });
        if !inertia.iter().chain(&link.shift_m).all(|number| number.is_finite()) {
            return refuse(link.line, &link.name, "link");
        }
    }
    for joint in &robot.joints {
        let Placement { rotation, translation_m } = joint.placement;
        let coupling = joint.coupling.as_ref().map_or([0.0; 2], |coupling| [coupling.ratio, coupling.offset]);
        let mut numbers = rotation.iter().flatten().chain(&translation_m).chain(&joint.axis).chain(&coupling);
        if !numbers.all(|number| number.is_finite()) {
            return refuse(joint.line, &joint.name, "joint");
        }
    }
    for actuator in &robot.actuators {
        let gains = match actuator.drive {
            Drive::Motor => [0.0; 2],
            Drive::Position { kp, kv } => [kp, kv],
            Drive::Velocity { kv } => [kv, 0.0],
        };
        if !gains.iter().chain([&actuator.gear]).all(|number| number.is_finite()) {
            return refuse(actuator.line, &actuator.name, "actuator");
        }
    }
    Ok(())
}

/// Refuses negative masses, and moving links that have a moment of inertia and no mass.
fn check_masses(robot: &Robot) -> Result<(), DescriptionError> {
    let moving = moving_links(robot);
    for (k, link) in robot.links.iter().enumerate() {
        let Some(inertia) = link.inertia else { continue };
        let wrong = if inertia.mass_kg < 0.0 {
            format!("link `{}` has the negative mass {} kg", link.name, inertia.mass_kg)
        } else if moving[k] && inertia.mass_kg == 0.0 && inertia.inertia_kg_m2 != [0.0; 6] {
            format!("link `{}` moves and has a moment of inertia, but no mass", link.name)
        } else {
            continue;
        };
        return Err(DescriptionError::at(&robot.file, link.line, wrong, "correct its <inertial>"));
    }
    Ok(())
}

/// Whether each link moves: whether a joint that is not fixed is between it and the base. The joints form a tree.
pub(crate) fn moving_links(robot: &Robot) -> Vec<bool> {
    let parents = parent_joints(robot);
    (0..robot.links.len())
        .map(|link| joints_above(robot, &parents, link).iter().any(|joint| is_moving(robot, *joint)))
        .collect()
}

/// Whether a joint moves.
pub(crate) fn is_moving(robot: &Robot, joint: usize) -> bool {
    robot.joints[joint].kind != JointKind::Fixed
}

/// The joint whose child is each link; `None` for the base.
pub(crate) fn parent_joints(robot: &Robot) -> Vec<Option<usize>> {
    let mut parents = vec![None; robot.links.len()];
    for (k, joint) in robot.joints.iter().enumerate() {
        parents[joint.child] = Some(k);
    }
    parents
}

/// The joints between a link and the base, fixed ones included, from the link on.
///
/// Ends after as many joints as the robot has, so that a loop of joints does not hang it.
pub(crate) fn joints_above(robot: &Robot, parents: &[Option<usize>], link: usize) -> Vec<usize> {
    let steps = std::iter::successors(parents[link], |joint| parents[robot.joints[*joint].parent]);
    steps.take(robot.joints.len()).collect()
}

/// The joints between a link and the outer ends of the robot.
pub(crate) fn joints_below(robot: &Robot, link: usize) -> Vec<usize> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); robot.links.len()];
    for (k, joint) in robot.joints.iter().enumerate() {
        children[joint.parent].push(k);
    }
    let mut below = Vec::new();
    let mut pending = vec![link];
    while let Some(link) = pending.pop() {
        for &joint in &children[link] {
            if below.len() < robot.joints.len() {
                below.push(joint);
                pending.push(robot.joints[joint].child);
            }
        }
    }
    below.sort_unstable();
    below
}

/// The entry of a joint of a kind that is not supported: it changes the motion of all joints between the base and the ends.
pub(crate) fn unsupported_joint(robot: &Robot, joint: usize, element: String) -> Unsupported {
    let Robot { joints, .. } = robot;
    let mut changed = joints_below(robot, joints[joint].child);
    changed.extend(joints_above(robot, &parent_joints(robot), joints[joint].child));
    changed.sort_unstable();
    changed.dedup();
    Unsupported { element, line: joints[joint].line, joints: changed }
}

/// The joint-space inertia of one joint at the references of all joints, kg m2 or kg: that of the links it moves, about its
/// axis, and the armature. `None` if a link has an inertia that is not known.
///
/// It is the diagonal element of the mass matrix. The mass of a prismatic joint is that of the links.
pub(crate) fn subtree_inertia(robot: &Robot, joint: usize) -> Option<f64> {
    let Joint { axis, armature, kind, child, .. } = &robot.joints[joint];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); robot.links.len()];
    for (k, joint) in robot.joints.iter().enumerate() {
        children[joint.parent].push(k);
    }
    let mut total = *armature;
    let mut pending = vec![(*child, Placement::IDENTITY)];
    while let Some((link, placement)) = pending.pop() {
        if let Some(inertia) = robot.links[link].inertia {
            total += match kind {
                JointKind::Prismatic => inertia.mass_kg,
                _ => {
                    // About an axis a through the origin: a^T I a + m (|c|^2 - (a c)^2).
                    let centre = add(placement.translation_m, apply(&placement.rotation, inertia.centre_m));
                    let moments = tensor(rotate_tensor(&placement.rotation, inertia.inertia_kg_m2));
                    let along = dot(*axis, centre);
                    dot(*axis, apply(&moments, *axis))
                        + inertia.mass_kg * (dot(centre, centre) - along * along)
                }
            };
        }
        for &next in &children[link] {
            pending.push((robot.joints[next].child, compose(&placement, &robot.joints[next].placement)));
        }
    }
    (total > 0.0).then_some(total)
}
