//! Places of a robot where a library row can be applied: joints, pairs of joints, the last link and gravity.

use super::row_place::Place;
use crate::model::{Joint, Output, RobotModel, Target};
use crate::text::Symbol;

/// Places `force` of a robot: the torque on every joint, with its position and speed.
pub(super) fn joint_places(robot: &RobotModel) -> Vec<Place> {
    let place = |(index, joint): (usize, &Joint)| Place {
        target: Target::Joint(index),
        others: Vec::new(),
        on: joint.name.clone(),
        with: None,
        names: vec![
            ("x", in_brackets(&joint.position.tree.text)),
            ("v", in_brackets(&joint.speed.tree.text)),
        ],
    };
    robot.joints.iter().enumerate().map(place).collect()
}

/// The places that another word stands for in a robot; none for an unknown word.
pub(super) fn places(word: &str, robot: &RobotModel, outputs: &[Output]) -> Vec<Place> {
    match word {
        "joint-load" => load_places(robot),
        "joint-drive" => drive_places(robot, outputs),
        "joint-pair" => pair_places(robot, &[]),
        "joint-inertia-pair" => inertia_pair_places(robot),
        "armature" => armature_places(robot),
        "payload" => payload_places(robot),
        "tilt" => tilt_places(robot),
        _ => Vec::new(),
    }
}

/// Places `joint-load`: every joint, with its speed and the torque that it transmits.
fn load_places(robot: &RobotModel) -> Vec<Place> {
    let mut places = joint_places(robot);
    for (place, joint) in places.iter_mut().zip(&robot.joints) {
        let load = match (&joint.acceleration, &joint.torque) {
            (Some(_), _) => format!("inverse_dynamics({})", joint.name),
            (None, Some(torque)) => in_brackets(&torque.tree.text),
            (None, None) => continue,
        };
        place.names.push(("load", load));
    }
    places.retain(|place| place.names.iter().any(|(name, _)| *name == "load"));
    places
}

/// Places `joint-drive`: every joint whose drive has a measured torque, with the declared value of that torque.
fn drive_places(robot: &RobotModel, outputs: &[Output]) -> Vec<Place> {
    let mut places = joint_places(robot);
    for (joint, place) in places.iter_mut().enumerate() {
        let of_joint = |o: &&Output| o.value.tree.symbols().any(|s| s == Symbol::JointTorque(joint));
        if let Some(output) = outputs.iter().find(of_joint) {
            place.names.push(("drive", in_brackets(&output.value.tree.text)));
        }
    }
    places.retain(|place| place.names.iter().any(|(name, _)| *name == "drive"));
    places
}

/// A name of a library row for the first joint of a pair and one for the second, and the text that they stand for.
type PairName = (&'static str, &'static str, fn(&Joint) -> Option<String>);

/// Places for every two joints, with the speed `v` of the first and `u` of the second, and further names of both.
fn pair_places(robot: &RobotModel, more: &[PairName]) -> Vec<Place> {
    let mut list = Vec::new();
    for (i, first) in robot.joints.iter().enumerate() {
        for (j, second) in robot.joints.iter().enumerate().skip(i + 1) {
            if robot.is_prismatic(i) != robot.is_prismatic(j) {
                continue;
            }
            let mut names =
                vec![("v", in_brackets(&first.speed.tree.text)), ("u", in_brackets(&second.speed.tree.text))];
            for (of_first, of_second, text) in more {
                if let (Some(a), Some(b)) = (text(first), text(second)) {
                    names.extend([(*of_first, a), (*of_second, b)]);
                }
            }
            list.push(Place {
                target: Target::Joint(i),
                others: vec![Target::Joint(j)],
                on: first.name.clone(),
                with: Some(second.name.clone()),
                names,
            });
        }
    }
    list
}

/// Places `joint-inertia-pair`: every two joints, with their accelerations `a` and `b`, where these are known.
fn inertia_pair_places(robot: &RobotModel) -> Vec<Place> {
    let acceleration = |joint: &Joint| joint.acceleration.as_ref().map(|e| in_brackets(&e.tree.text));
    let mut places = pair_places(robot, &[("a", "b", acceleration)]);
    places.retain(|place| place.names.iter().any(|(name, _)| *name == "a"));
    places
}

/// Places `armature`: the rotor inertia of every joint.
fn armature_places(robot: &RobotModel) -> Vec<Place> {
    let mut places = joint_places(robot);
    for (joint, place) in places.iter_mut().enumerate() {
        (place.target, place.names) = (Target::Armature(joint), Vec::new());
    }
    places
}

/// Place `payload`: the ten inertial parameters of the last link, as targets in their order.
fn payload_places(robot: &RobotModel) -> Vec<Place> {
    let Some(body) = robot.tree.bodies.len().checked_sub(1) else { return Vec::new() };
    let of_body = |attached: &augsim_robot::tree::Attached| attached.body == body;
    let Some(link) = robot.tree.links.iter().position(of_body) else { return Vec::new() };
    vec![Place {
        target: Target::Inertia(link, 0),
        others: (1..10).map(|k| Target::Inertia(link, k)).collect(),
        on: robot.links[link].name.clone(),
        with: None,
        names: Vec::new(),
    }]
}

/// Place `tilt`: the two components of gravity across its nominal direction, and the one along it.
fn tilt_places(robot: &RobotModel) -> Vec<Place> {
    let size = |axis: &usize| robot.nominal_gravity(*axis).abs();
    let along = (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(2);
    let across: Vec<usize> = (0..3).filter(|axis| *axis != along).collect();
    if size(&along) == 0.0 {
        return Vec::new();
    }
    vec![Place {
        target: Target::Gravity(across[0]),
        others: vec![Target::Gravity(across[1]), Target::Gravity(along)],
        on: "gravity".to_owned(),
        with: None,
        names: Vec::new(),
    }]
}

/// An expression as a factor: in brackets unless it is a name.
fn in_brackets(text: &str) -> String {
    let is_name = text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    if is_name { text.to_owned() } else { format!("({text})") }
}
