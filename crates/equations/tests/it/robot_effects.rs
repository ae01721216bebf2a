//! Contract: an effect on a robot changes the torque of its joints, its inertias or its gravity as its formula says, in both
//! formulations.
//!
//! In the inverse formulation the torque of an effect is subtracted, because the drive must overcome it; in the forward one it
//! is added to the torque of the drive, before the mass matrix.

use crate::robot::{Arm, Motion, assert_close, compiled, outputs, rates};
use augsim_equations::engine::{Method, Options, Record, Signal, Window};
use augsim_equations::library::candidates;
use augsim_equations::model::Hold;
use augsim_robot::dynamic_parameters;

/// Asserts what torques an effect adds to the joints of an arm, in both formulations.
///
/// `torque` is computed from position, speed, acceleration and the torque of rigid bodies and rotors of each joint.
fn check_torques(arm: &Arm, block: &str, torque: impl Fn(&Motion, &[f64]) -> Vec<f64>) {
    let (inverse, forward) = (arm.inverse(&[], block), arm.forward(&[], block));
    for motion in (0..3).map(|k| arm.motion(k)) {
        let rigid = arm.torques(&motion);
        let added = torque(&motion, &rigid);
        let expected: Vec<f64> = rigid.iter().zip(&added).map(|(rigid, added)| rigid - added).collect();
        assert_close(&outputs(&inverse, &motion), &expected, 1e-12, block);
        // With these torques of the drives the arm moves as before.
        let [position, speed, acceleration] = &motion;
        let driven = [position.clone(), speed.clone(), rigid.clone()];
        let added = torque(&[position.clone(), speed.clone(), acceleration.clone()], &rigid);
        let total: Vec<f64> = rigid.iter().zip(&added).map(|(rigid, added)| rigid + added).collect();
        let moved = arm.accelerations(&[position.clone(), speed.clone(), total]);
        assert_close(&rates(&forward, &driven), &moved, 1e-9, block);
    }
}

fn effect(kind: &str, on: &str, values: &str) -> String {
    format!("[[effect]]\nkind = \"{kind}\"\non = \"{on}\"\n{values}\n")
}

#[test]
fn coulomb_friction_opposes_the_speed_of_its_joint_alone() {
    let block = effect("coulomb", "elbow", "f = 0.6\nw = 0.2");
    check_torques(&Arm::two_links(), &block, |[_, speed, _], _| vec![0.0, -0.6 * (speed[1] / 0.2).tanh()]);
}

#[test]
fn an_effect_on_all_joints_has_values_of_each_joint() {
    let values = "f_shoulder = 0.6\nf_elbow = 0.25\nw_shoulder = 0.2\nw_elbow = 0.5";
    let block = effect("coulomb", "all joints", values);
    check_torques(&Arm::two_links(), &block, |[_, speed, _], _| {
        vec![-0.6 * (speed[0] / 0.2).tanh(), -0.25 * (speed[1] / 0.5).tanh()]
    });
}

#[test]
fn two_effects_on_a_joint_are_added() {
    let block = effect("linear-stiffness", "elbow", "k = 2.0") + &effect("constant", "elbow", "a = 0.3");
    check_torques(&Arm::two_links(), &block, |[position, ..], _| vec![0.0, 0.3 - 2.0 * position[1]]);
}

#[test]
fn load_friction_grows_with_the_torque_of_rigid_bodies_that_the_joint_transmits() {
    let block = effect("coulomb", "shoulder", "f = 0.6\nw = 0.2")
        + &effect("load-friction", "shoulder", "c = 0.1\nw = 0.3");
    check_torques(&Arm::two_links(), &block, |[_, speed, _], rigid| {
        vec![-0.6 * (speed[0] / 0.2).tanh() - 0.1 * rigid[0].abs() * (speed[0] / 0.3).tanh(), 0.0]
    });
}

#[test]
fn coupled_friction_acts_on_both_joints() {
    let block = effect("coupled-coulomb", "shoulder", "with = \"elbow\"\nf = 0.5\nr = -2.0\nw = 0.7");
    check_torques(&Arm::two_links(), &block, |[_, speed, _], _| {
        let smooth = ((speed[0] - 2.0 * speed[1]) / 0.7).tanh();
        vec![-0.5 * smooth, 1.0 * smooth]
    });
    let damped = effect("coupled-damping", "shoulder", "with = \"elbow\"\nc = 0.4");
    check_torques(&Arm::two_links(), &damped, |[_, speed, _], _| vec![-0.4 * (speed[0] + speed[1]); 2]);
    let opposed = effect("opposed-damping", "shoulder", "with = \"elbow\"\nc = 0.4");
    check_torques(&Arm::two_links(), &opposed, |[_, speed, _], _| {
        let torque = -0.4 * (speed[0] - speed[1]);
        vec![torque, -torque]
    });
}

#[test]
fn coupled_inertia_acts_on_both_joints_where_accelerations_are_known() {
    let arm = Arm::two_links();
    let motion = arm.motion(1);
    let [_, _, acceleration] = &motion;
    let rigid = arm.torques(&motion);
    for (kind, sign) in [("coupled-inertia", 1.0), ("opposed-inertia", -1.0)] {
        let block = effect(kind, "shoulder", "with = \"elbow\"\nJ = 0.2");
        let torque = 0.2 * (acceleration[0] + sign * acceleration[1]);
        let expected = [rigid[0] + torque, rigid[1] + sign * torque];
        assert_close(&outputs(&arm.inverse(&[], &block), &motion), &expected, 1e-12, kind);
    }
    let forward = candidates(&arm.forward(&[], "")).expect("candidates");
    assert!(!forward.iter().any(|c| c.kind.ends_with("-inertia") && c.with.is_some()));
}

/// Asserts that an effect changes a robot as `change` does, in both formulations.
fn check_changed(block: &str, change: impl Fn(&mut Arm), gravity: [f64; 3]) {
    let arm = || Arm::new("six-axis-arm.urdf", &["axis1", "axis2", "axis3", "axis4", "axis5", "axis6"]);
    let (plain, mut changed) = (arm(), arm());
    change(&mut changed);
    changed.robot.gravity_m_s2 = Some(gravity);
    let (inverse, forward) = (plain.inverse(&[], block), plain.forward(&[], block));
    for motion in (0..3).map(|k| plain.motion(k)) {
        assert_close(&outputs(&inverse, &motion), &changed.torques(&motion), 1e-12, block);
        assert_close(&rates(&forward, &motion), &changed.accelerations(&motion), 1e-9, block);
    }
}

const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

#[test]
fn a_rotor_inertia_is_an_armature() {
    let add = |arm: &mut Arm| {
        let joint = arm.robot.joint("axis3").expect("a joint");
        arm.robot.joints[joint].armature += 0.4;
    };
    check_changed(&effect("rotor-inertia", "axis3", "J = 0.4"), add, GRAVITY);
}

#[test]
fn a_payload_is_a_point_mass_on_the_last_link() {
    // The centre of mass and the inertia of the flange with a point mass of 1.2 kg at this place.
    let (mass, place) = (1.2, [0.1, -0.05, 0.15]);
    let add = |arm: &mut Arm| {
        let link = arm.robot.link("flange").expect("a link");
        let flange = arm.robot.links[link].inertia.expect("an inertia");
        let mut parameters = dynamic_parameters(&flange);
        let [x, y, z] = place;
        let point = [1.0, x, y, z, y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y];
        parameters.iter_mut().zip(point).for_each(|(p, of_point)| *p += mass * of_point);
        arm.robot.links[link].inertia = augsim_robot::inertia_of(&parameters);
    };
    let block = effect("payload", "flange", "m = 1.2\np_x = 0.12\np_y = -0.06\np_z = 0.18");
    check_changed(&block, add, GRAVITY);
}

#[test]
fn a_dead_zone_asks_more_torque_of_the_drive_wherever_it_gives_some() {
    let arm = Arm::two_links();
    let model = arm.inverse(&[], &effect("dead-zone", "shoulder", "d = 0.4\nw = 0.05"));
    for motion in (0..3).map(|k| arm.motion(k)) {
        let rigid = arm.torques(&motion);
        let expected = [rigid[0] + 0.4 * (rigid[0] / 0.05).tanh(), rigid[1]];
        assert_close(&outputs(&model, &motion), &expected, 1e-12, "dead-zone");
    }
}

#[test]
fn a_tilt_changes_gravity_across_and_along_its_direction() {
    check_changed(
        &effect("tilt", "gravity", "a = 3.5\nb = -1.2\nc = 0.7"),
        |_| (),
        [3.5, -1.2, GRAVITY[2] + 0.7],
    );
}

#[test]
fn an_effect_with_a_state_works_in_a_model_that_declares_none() {
    let arm = Arm::two_links();
    let model = arm.inverse(&[], &effect("presliding", "elbow", "k = 3.0\nd = 0.1"));
    // The elbow turns at 0.5 rad/s; the state z of the bristles approaches d = 0.1 rad.
    let times: Vec<f64> = (0..41).map(|k| 0.01 * f64::from(k)).collect();
    let (speed, depth) = (0.5, 0.1);
    let rise = |name: &str| match name {
        "q1" => times.iter().map(|t| speed * t).collect(),
        "w1" => vec![speed; times.len()],
        _ => vec![0.0; times.len()],
    };
    let signals =
        model.inputs.iter().map(|input| Signal::new(&times, &rise(&input.name), Hold::Linear)).collect();
    let record = Record::new("turn", times.clone(), signals).expect("rising times");
    let parameters = model.nominals();
    let window = Window { record: &record, first: 0, last: 40, start: &[0.0], parameters: &parameters };
    let options = Options { method: Method::RungeKutta, substeps: 4 };
    let values = compiled(&model).simulate(&[window], &[], &options).remove(0).expect("a simulation").values;
    for (k, t) in times.iter().enumerate() {
        let motion = [vec![0.0, speed * t], vec![0.0, speed], vec![0.0; 2]];
        let bristles = depth * (1.0 - (-speed * t / depth).exp());
        let expected = arm.torques(&motion)[1] + 3.0 * bristles;
        assert!((values[2 * k + 1] - expected).abs() < 1e-8, "{t} s: {} {expected}", values[2 * k + 1]);
    }
}

#[test]
fn every_candidate_of_a_robot_leaves_the_torques_unchanged_at_its_null() {
    let arm = Arm::two_links();
    let (plain, motion) = (arm.inverse(&[], ""), arm.motion(2));
    let rigid = arm.torques(&motion);
    let all = candidates(&plain).unwrap_or_else(|e| panic!("{e}"));
    let places: Vec<&str> = all.iter().map(|c| c.on.as_str()).collect();
    for place in ["shoulder", "elbow", "all joints", "forearm", "gravity", "tau0"] {
        assert!(places.contains(&place), "{place} is no place");
    }
    for candidate in all {
        for values in candidate.null_points() {
            let mut augmented = plain.clone();
            augmented.add(&candidate.draft(&values)).unwrap_or_else(|e| panic!("{e}"));
            if augmented.states.is_empty() {
                assert_close(&outputs(&augmented, &motion), &rigid, 1e-9, &candidate.name);
            }
        }
    }
}
