//! Contract: the tree has the named joints in their order, merges what stays, and refuses what it cannot represent.

use std::collections::BTreeMap;

use augsim_robot::description::{Coupling, JointKind, Placement, Robot, Unsupported};
use augsim_robot::{Tree, TreeError};

use crate::arms::{elbow_arm, empty_link, general_arm, gripper, joint, link, names, robot};

/// The error of a tree with these joints, as text.
fn refusal(robot: &Robot, joints: &[&str], locked: &[(&str, f64)]) -> String {
    let locked = locked.iter().map(|&(name, position)| (name.to_owned(), position)).collect();
    Tree::new(robot, &names(joints), &locked).expect_err("the tree is refused").to_string()
}

/// The tree with these joints and nothing locked.
fn tree(robot: &Robot, joints: &[&str]) -> Tree {
    Tree::new(robot, &names(joints), &BTreeMap::new()).expect("the tree is valid")
}

#[test]
fn coordinates_are_in_the_order_of_the_names() {
    let tree = tree(&general_arm(), &["wrist", "shoulder", "slider"]);
    let coordinates: Vec<usize> = tree.bodies.iter().map(|body| body.coordinate).collect();
    assert_eq!(coordinates, [1, 2, 0]);
    let parents: Vec<_> = tree.bodies.iter().map(|body| body.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(1)]);
}

#[test]
fn links_behind_locked_joints_are_merged_into_the_body_before_them() {
    let robot = general_arm();
    let locked = [("slider".to_owned(), 0.25)].into();
    let tree = Tree::new(&robot, &names(&["shoulder"]), &locked).expect("the tree is valid");
    assert_eq!(tree.bodies.len(), 1);
    let links: Vec<usize> = tree.links.iter().map(|attached| attached.link).collect();
    assert_eq!(links, [1, 2, 3]);
    // The slide is moved by 0.25 m along its axis, seen in the frame of the first body.
    let joint = &robot.joints[1];
    for row in 0..3 {
        let moved: f64 = (0..3).map(|k| joint.placement.rotation[row][k] * joint.axis[k] * 0.25).sum();
        let expected = joint.placement.translation_m[row] + moved;
        approx::assert_abs_diff_eq!(tree.links[1].placement.translation_m[row], expected, epsilon = 1e-15);
    }
}

#[test]
fn coupled_joints_move_with_their_leader_through_chains_and_references() {
    let tree = tree(&gripper(), &["turn", "left_finger"]);
    let motions: Vec<_> = tree.bodies.iter().map(|body| (body.coordinate, body.ratio)).collect();
    assert_eq!(motions, [(0, 1.0), (1, 1.0), (1, -2.0), (1, -6.0)]);
    // left: q - 0.02; right: -2 q + 0.05; tip: 3 (-2 q + 0.05) + 0.1 + 0.3.
    let offsets: Vec<f64> = tree.bodies.iter().map(|body| body.offset).collect();
    for (offset, expected) in offsets.iter().zip([0.0, -0.02, 0.05, 0.55]) {
        approx::assert_abs_diff_eq!(*offset, expected, epsilon = 1e-15);
    }
}

#[test]
fn followers_of_a_locked_joint_stay_where_it_puts_them() {
    let robot = gripper();
    let locked = [("left_finger".to_owned(), 0.1)].into();
    let tree = Tree::new(&robot, &names(&["turn"]), &locked).expect("the tree is valid");
    assert_eq!(tree.bodies.len(), 1);
    // The right finger is at -2 * 0.1 + 0.05 = -0.15 m along y of its frame.
    let joint = &robot.joints[2];
    let expected = joint.placement.translation_m[0] - 0.15 * joint.placement.rotation[0][1];
    let right = tree.links.iter().find(|attached| attached.link == 3).expect("the link is attached");
    approx::assert_abs_diff_eq!(right.placement.translation_m[0], expected, epsilon = 1e-15);
}

#[test]
fn names_that_cannot_move_are_refused_with_advice() {
    let mut arm = general_arm();
    assert_eq!(refusal(&arm, &["wirst"], &[]), "`arm.urdf` has no joint `wirst`; did you mean `wrist`?");
    assert_eq!(
        refusal(&arm, &["axis_number_9"], &[]),
        "`arm.urdf` has no joint `axis_number_9`; it has `shoulder`, `slider`, `wrist`"
    );
    assert_eq!(
        refusal(&arm, &["wrist", "wrist"], &[]),
        "joint `wrist` is named twice; name each moving joint once"
    );
    assert!(refusal(&arm, &["wrist"], &[("slidr", 0.0)]).ends_with("did you mean `slider`?"));
    assert!(refusal(&arm, &["wrist"], &[("wrist", 0.0)]).contains("joint `wrist` is both moving and locked"));
    assert!(refusal(&arm, &["wrist"], &[("slider", f64::NAN)]).contains("not a finite number"));
    arm.joints[1].kind = JointKind::Fixed;
    assert_eq!(
        refusal(&arm, &["slider"], &[]),
        "joint `slider` (arm.urdf, line 12) is fixed and cannot move; remove its name"
    );
    assert_eq!(
        refusal(&gripper(), &["right_finger"], &[]),
        "joint `right_finger` (arm.urdf, line 13) follows joint `left_finger`; name `left_finger` instead, \
         `right_finger` then moves with it"
    );
    let moving = refusal(&gripper(), &["left_finger"], &[("tip_joint", 0.0)]);
    assert!(
        moving.contains("joint `tip_joint` is locked, but it moves with joint `left_finger`"),
        "{moving}"
    );
}

#[test]
fn unsupported_elements_are_refused_only_where_they_act_on_a_moving_joint() {
    let mut arm = general_arm();
    arm.unsupported = vec![Unsupported { element: "tendon `cable`".to_owned(), line: 7, joints: vec![1] }];
    tree(&arm, &["shoulder", "wrist"]);
    let message = refusal(&arm, &["slider"], &[]);
    assert!(
        message.starts_with("tendon `cable` (arm.urdf, line 7) is not supported and acts on joint `slider`")
    );
}

#[test]
fn couplings_in_a_circle_and_loops_of_joints_are_refused() {
    let mut hand = gripper();
    hand.joints[1].coupling = Some(Coupling { joint: 3, ratio: 1.0, offset: 0.0 });
    assert!(refusal(&hand, &["turn"], &[]).contains("follows itself through its couplings"));
    let mut arm = elbow_arm();
    arm.joints.push(joint("closing", JointKind::Revolute, [3, 1], [0.0, 0.0, 1.0]));
    assert!(refusal(&arm, &["shoulder"], &[]).contains("link `upper` (arm.urdf, line 1) is part of a loop"));
    arm.joints.remove(0);
    assert!(refusal(&arm, &["wrist"], &[]).contains("is part of a loop"));
}

#[test]
fn a_joint_without_inertia_is_refused_for_forward_dynamics_unless_it_has_an_armature() {
    let mut arm = elbow_arm();
    arm.links[3] = empty_link("hand");
    let joints = ["shoulder", "slider", "wrist"];
    let message = tree(&arm, &joints).check_inertia(&arm).expect_err("the wrist moves nothing").to_string();
    assert!(message.contains("joint `wrist` (arm.urdf, line 13) moves no positive inertia"), "{message}");
    arm.joints[2].armature = 0.01;
    assert_eq!(tree(&arm, &joints).check_inertia(&arm), Ok(()));
}

#[test]
fn a_massless_link_between_joints_is_allowed_unless_their_axes_are_in_line() {
    let links = vec![empty_link("base"), empty_link("cross"), link("hand", 0.3)];
    let joints = vec![
        joint("first", JointKind::Revolute, [0, 1], [0.0, 0.0, 1.0]),
        joint("second", JointKind::Revolute, [1, 2], [0.0, 0.0, 1.0]),
    ];
    // The second axis is turned by 90 degrees and away from the first one.
    let mut universal = robot(links, joints);
    assert_eq!(tree(&universal, &["first", "second"]).check_inertia(&universal), Ok(()));
    universal.joints[1].placement = Placement::IDENTITY;
    let refused = tree(&universal, &["first", "second"]).check_inertia(&universal);
    assert!(matches!(refused, Err(TreeError::NoInertia { .. })), "{refused:?}");
}
