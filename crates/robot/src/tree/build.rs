//! Construction of the tree of moving bodies from a description and the names of the moving joints.

use std::collections::BTreeMap;

use super::{Attached, Body, Tree, TreeError};
use crate::description::{Joint, JointKind, Placement, Robot};
use crate::names::suggestion;
use crate::rotation::about_axis;
use crate::vectors::{composed, rounded};

/// What a joint of the description does in the tree.
enum Motion {
    /// Position = `ratio` * coordinate + `offset`.
    Moving { coordinate: usize, ratio: f64, offset: f64 },
    /// The joint stays at a position, rad or m.
    Still { position: f64 },
}

impl Tree {
    /// The moving bodies of a robot whose named joints move, in the order of the coordinates.
    ///
    /// A joint that is coupled to a moving joint moves with it, also through several couplings. Every other joint is fixed:
    /// at its position in `locked` (rad or m) if it is there, else at the position that its coupling to a fixed joint gives,
    /// else at its reference.
    ///
    /// # Errors
    /// If a name is unknown, stated twice, or that of a fixed or coupled joint; if an unsupported element acts on a moving
    /// joint; or if the joints form a loop. See [`Tree::check_inertia`] for links without inertia.
    pub fn new(robot: &Robot, joints: &[String], locked: &BTreeMap<String, f64>) -> Result<Tree, TreeError> {
        let named = named_joints(robot, joints)?;
        check_locked(robot, &named, locked)?;
        let motions = (0..robot.joints.len())
            .map(|joint| motion(robot, joint, &named, locked))
            .collect::<Result<Vec<_>, _>>()?;
        check_supported(robot, &motions)?;
        assemble(robot, &motions, named.len())
    }
}

/// Indices of the moving joints; an error for a name that cannot be one.
fn named_joints(robot: &Robot, joints: &[String]) -> Result<Vec<usize>, TreeError> {
    let mut named = Vec::new();
    for name in joints {
        let index = find(robot, name)?;
        let joint = movable(robot, index)?;
        if named.contains(&index) {
            return Err(TreeError::NamedTwice { joint: name.clone() });
        }
        if let Some(coupling) = &joint.coupling {
            return Err(TreeError::Coupled {
                file: robot.file.clone(),
                joint: name.clone(),
                line: joint.line,
                leader: robot.joints[coupling.joint].name.clone(),
            });
        }
        named.push(index);
    }
    Ok(named)
}

/// Index of the joint with this name; an error with the closest name if there is none.
fn find(robot: &Robot, name: &str) -> Result<usize, TreeError> {
    // Suggested are joints that can move.
    let movable = robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    robot.joint(name).ok_or_else(|| TreeError::UnknownJoint {
        file: robot.file.clone(),
        joint: name.to_owned(),
        suggestion: suggestion(name, movable.map(|joint| joint.name.as_str())),
    })
}

/// The joint, or an error if it is fixed.
fn movable(robot: &Robot, index: usize) -> Result<&Joint, TreeError> {
    let joint = &robot.joints[index];
    if joint.kind == JointKind::Fixed {
        let (file, name) = (robot.file.clone(), joint.name.clone());
        return Err(TreeError::Fixed { file, joint: name, line: joint.line });
    }
    Ok(joint)
}

/// Refuses locked joints that are unknown, fixed, or moving, and positions that are not finite.
fn check_locked(robot: &Robot, named: &[usize], locked: &BTreeMap<String, f64>) -> Result<(), TreeError> {
    for (name, position) in locked {
        let index = find(robot, name)?;
        movable(robot, index)?;
        if !position.is_finite() {
            return Err(TreeError::LockedNotFinite { joint: name.clone() });
        }
        if let Motion::Moving { coordinate, .. } = motion(robot, index, named, &BTreeMap::new())? {
            let (joint, leader) = (name.clone(), robot.joints[named[coordinate]].name.clone());
            return Err(match index == named[coordinate] {
                true => TreeError::MovingAndLocked { joint },
                false => TreeError::LockedFollower { joint, leader },
            });
        }
    }
    Ok(())
}

/// What a joint does: follows its couplings until a moving, locked or independent joint.
fn motion(
    robot: &Robot,
    start: usize,
    named: &[usize],
    locked: &BTreeMap<String, f64>,
) -> Result<Motion, TreeError> {
    // Position of the joint `start` = ratio * position of the joint `current` + offset.
    let (mut ratio, mut offset, mut current) = (1.0, 0.0, start);
    for _ in 0..=robot.joints.len() {
        let joint = &robot.joints[current];
        if joint.kind == JointKind::Fixed {
            return Ok(Motion::Still { position: ratio * joint.reference + offset });
        }
        if let Some(coordinate) = named.iter().position(|&index| index == current) {
            return Ok(match ratio {
                0.0 => Motion::Still { position: offset },
                _ => Motion::Moving { coordinate, ratio, offset },
            });
        }
        if let Some(position) = locked.get(&joint.name) {
            return Ok(Motion::Still { position: ratio * position + offset });
        }
        let Some(coupling) = &joint.coupling else {
            return Ok(Motion::Still { position: ratio * joint.reference + offset });
        };
        offset += ratio * coupling.offset;
        ratio *= coupling.ratio;
        current = coupling.joint;
    }
    let joint = &robot.joints[start];
    Err(TreeError::CircularCoupling { file: robot.file.clone(), joint: joint.name.clone(), line: joint.line })
}

/// Refuses unsupported elements that act on a moving joint.
fn check_supported(robot: &Robot, motions: &[Motion]) -> Result<(), TreeError> {
    for unsupported in &robot.unsupported {
        let moves = |joint: &&usize| matches!(motions.get(**joint), Some(Motion::Moving { .. }));
        if let Some(&joint) = unsupported.joints.iter().find(moves) {
            return Err(TreeError::Unsupported {
                file: robot.file.clone(),
                element: unsupported.element.clone(),
                line: unsupported.line,
                joint: robot.joints[joint].name.clone(),
            });
        }
    }
    Ok(())
}

/// A link that was reached and whose joints are still to be followed.
struct Reached {
    link: usize,
    /// Body of the link; `None` for the base.
    body: Option<usize>,
    /// Placement of the link in its body.
    placement: Placement,
    /// The body that begins at this link, if its joint moves.
    new_body: Option<Body>,
}

/// Walks from the base over all joints; merges links behind joints that stay.
fn assemble(robot: &Robot, motions: &[Motion], coordinates: usize) -> Result<Tree, TreeError> {
    let mut tree = Tree { bodies: Vec::new(), links: Vec::new(), coordinates };
    let mut is_placed = vec![false; robot.links.len()];
    let is_root = |link: &usize| robot.joints.iter().all(|joint| joint.child != *link);
    let start = |link| Reached { link, body: None, placement: Placement::IDENTITY, new_body: None };
    // A stack, so that the bodies of one branch follow each other.
    let mut open: Vec<Reached> = (0..robot.links.len()).filter(is_root).rev().map(start).collect();
    while let Some(Reached { link, mut body, placement, new_body }) = open.pop() {
        if std::mem::replace(&mut is_placed[link], true) {
            return Err(loop_at(robot, link));
        }
        if let Some(new_body) = new_body {
            body = Some(tree.bodies.len());
            tree.bodies.push(new_body);
        }
        if let Some(body) = body {
            tree.links.push(Attached { link, body, placement });
        }
        let children = robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link);
        open.extend(children.rev().map(|(index, _)| follow(robot, index, &motions[index], body, &placement)));
    }
    match is_placed.iter().position(|placed| !placed) {
        Some(link) => Err(loop_at(robot, link)),
        None => Ok(tree),
    }
}

/// The child link of a joint, in the body of its parent link or in a new one.
fn follow(
    robot: &Robot,
    index: usize,
    motion: &Motion,
    parent: Option<usize>,
    placement: &Placement,
) -> Reached {
    let joint = &robot.joints[index];
    let origin = composed(placement, &joint.placement);
    match *motion {
        Motion::Still { position } => {
            let placement = composed(&origin, &displaced(joint, position - joint.reference));
            Reached { link: joint.child, body: parent, placement, new_body: None }
        }
        Motion::Moving { coordinate, ratio, offset } => {
            let body = Body {
                joint: index,
                parent,
                placement: origin,
                is_prismatic: joint.kind == JointKind::Prismatic,
                axis: joint.axis.map(rounded),
                coordinate,
                ratio,
                offset: offset - joint.reference,
            };
            Reached { link: joint.child, body: None, placement: Placement::IDENTITY, new_body: Some(body) }
        }
    }
}

/// Error for a link that is part of a loop.
fn loop_at(robot: &Robot, link: usize) -> TreeError {
    let found = &robot.links[link];
    TreeError::Loop { file: robot.file.clone(), link: found.name.clone(), line: found.line }
}

/// Placement of the child frame after a displacement of the joint from its reference.
fn displaced(joint: &Joint, displacement: f64) -> Placement {
    match joint.kind {
        JointKind::Fixed => Placement::IDENTITY,
        JointKind::Revolute => {
            Placement { rotation: about_axis(joint.axis, displacement), ..Placement::IDENTITY }
        }
        JointKind::Prismatic => {
            Placement { translation_m: joint.axis.map(|x| displacement * x), ..Placement::IDENTITY }
        }
    }
}
