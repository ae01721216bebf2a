//! Contract: the equations of motion agree with closed forms, with each other, and with mechanical identities.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use augsim_robot::description::{Inertia, JointKind, Placement, Robot};
use augsim_robot::{
    Lanes, Numbers, Tree, forward_dynamics, inverse_dynamics, inverse_dynamics_derivatives, mass_matrix,
    regressor,
};

use crate::arms::{elbow_arm, empty_link, general_arm, gripper, joint, link, names, robot};

/// Gravity that is along no axis of a frame, m/s2.
const GRAVITY: [f64; 3] = [1.0, -2.0, -9.0];

/// A tree with the parameters of its bodies.
struct Arm {
    tree: Tree,
    parameters: Vec<[f64; 10]>,
    armature: Vec<f64>,
}

impl Arm {
    fn new(robot: &Robot, joints: &[&str]) -> Arm {
        let tree = Tree::new(robot, &names(joints), &BTreeMap::new()).expect("the tree is valid");
        let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(robot));
        let armature = tree.armature(robot);
        Arm { tree, parameters, armature }
    }

    fn torque(&self, position: &[f64], speed: &[f64], acceleration: &[f64]) -> Vec<f64> {
        inverse_dynamics(&mut Numbers, &self.tree, &self.parameters, GRAVITY, position, speed, acceleration)
    }
}

/// Arms with two or three coordinates, revolute, prismatic and coupled.
fn arms() -> Vec<Arm> {
    let mut general = general_arm();
    general.joints[1].armature = 0.3;
    vec![
        Arm::new(&general, &["wrist", "shoulder", "slider"]),
        Arm::new(&elbow_arm(), &["shoulder", "slider", "wrist"]),
        Arm::new(&gripper(), &["turn", "left_finger"]),
    ]
}

const POSITION: [f64; 3] = [0.4, -0.3, 0.9];
const SPEED: [f64; 3] = [1.2, -0.8, 0.5];
const ACCELERATION: [f64; 3] = [-2.0, 3.0, 1.5];

fn assert_close(x: &[f64], y: &[f64], tolerance: f64) {
    assert_eq!(x.len(), y.len());
    let scale = y.iter().fold(1.0_f64, |largest, value| largest.max(value.abs()));
    for (x, y) in x.iter().zip(y) {
        assert!((x - y).abs() <= tolerance * scale, "{x} and {y}");
    }
}

#[test]
fn torques_of_two_planar_links_are_those_of_the_closed_form() {
    let point = |name: &str| {
        let inertia = Inertia {
            mass_kg: 2.0,
            centre_m: [0.5, 0.0, 0.0],
            inertia_kg_m2: [0.0, 0.1, 0.1, 0.0, 0.0, 0.0],
        };
        augsim_robot::description::Link { inertia: Some(inertia), ..link(name, 0.0) }
    };
    let mut joints = vec![
        joint("first", JointKind::Revolute, [0, 1], [0.0, 0.0, 1.0]),
        joint("second", JointKind::Revolute, [1, 2], [0.0, 0.0, 1.0]),
    ];
    joints[0].placement = Placement::IDENTITY;
    joints[1].placement = Placement { translation_m: [1.0, 0.0, 0.0], ..Placement::IDENTITY };
    let arm = Arm::new(
        &robot(vec![empty_link("base"), point("upper"), point("lower")], joints),
        &["first", "second"],
    );
    let (q, w, e) = ([0.4, -0.9], [1.1, 0.7], [2.0, -1.0]);
    let gravity = [0.0, -9.81, 0.0];
    let torque = inverse_dynamics(&mut Numbers, &arm.tree, &arm.parameters, gravity, &q, &w, &e);
    // Spong, Hutchinson and Vidyasagar, section 6.4: l1 = 1, lc = 0.5, m = 2, I = 0.1.
    let (sin, cos) = f64::sin_cos(q[1]);
    let m11 = 2.0 * 0.25 + 2.0 * (1.0 + 0.25 + cos) + 0.2;
    let (m12, m22, h) = (2.0 * (0.25 + 0.5 * cos) + 0.1, 2.0 * 0.25 + 0.1, -2.0 * 0.5 * sin);
    let g2 = 2.0 * 0.5 * 9.81 * (q[0] + q[1]).cos();
    let g1 = (2.0 * 0.5 + 2.0) * 9.81 * q[0].cos() + g2;
    let expected = [
        m11 * e[0] + m12 * e[1] + h * w[1] * w[0] + h * (w[0] + w[1]) * w[1] + g1,
        m12 * e[0] + m22 * e[1] - h * w[0] * w[0] + g2,
    ];
    assert_close(&torque, &expected, 1e-14);
}

#[test]
fn forward_dynamics_inverts_inverse_dynamics() {
    for arm in arms() {
        let n = arm.tree.coordinates;
        let (position, speed, acceleration) = (&POSITION[..n], &SPEED[..n], &ACCELERATION[..n]);
        let mut torque = arm.torque(position, speed, acceleration);
        for k in 0..n {
            torque[k] += arm.armature[k] * acceleration[k];
        }
        let (tree, parameters) = (&arm.tree, &arm.parameters);
        let result = forward_dynamics(
            &mut Numbers,
            tree,
            parameters,
            GRAVITY,
            &arm.armature,
            position,
            speed,
            &torque,
        );
        assert_close(&result, acceleration, 1e-12);
    }
}

#[test]
fn mass_matrix_is_the_change_of_torque_by_acceleration() {
    for arm in arms() {
        let n = arm.tree.coordinates;
        let matrix = mass_matrix(&mut Numbers, &arm.tree, &arm.parameters, &vec![0.0; n], &POSITION[..n]);
        let bias = arm.torque(&POSITION[..n], &SPEED[..n], &vec![0.0; n]);
        for column in 0..n {
            let mut unit = vec![0.0; n];
            unit[column] = 1.0;
            let torque = arm.torque(&POSITION[..n], &SPEED[..n], &unit);
            let difference: Vec<f64> = torque.iter().zip(&bias).map(|(t, b)| t - b).collect();
            let values: Vec<f64> = matrix.iter().map(|row| row[column]).collect();
            assert_close(&values, &difference, 1e-12);
        }
    }
}

#[test]
fn power_of_the_torques_is_the_change_of_the_energy() {
    // Kinetic energy = half the speeds times the mass matrix times the speeds; gravity's power is that of its torque.
    for arm in arms() {
        let n = arm.tree.coordinates;
        let energy = |time: f64| {
            let at = |k: usize| POSITION[k] + SPEED[k] * time + 0.5 * ACCELERATION[k] * time * time;
            let position: Vec<f64> = (0..n).map(at).collect();
            let speed: Vec<f64> = (0..n).map(|k| SPEED[k] + ACCELERATION[k] * time).collect();
            let matrix = mass_matrix(&mut Numbers, &arm.tree, &arm.parameters, &vec![0.0; n], &position);
            let product = |row: &Vec<f64>| row.iter().zip(&speed).map(|(m, w)| m * w).sum::<f64>();
            0.5 * matrix.iter().zip(&speed).map(|(row, w)| w * product(row)).sum::<f64>()
        };
        // Central difference of fourth order.
        let d = 1e-3;
        let change = (8.0 * (energy(d) - energy(-d)) - (energy(2.0 * d) - energy(-2.0 * d))) / (12.0 * d);
        let torque = arm.torque(&POSITION[..n], &SPEED[..n], &ACCELERATION[..n]);
        let gravity = arm.torque(&POSITION[..n], &vec![0.0; n], &vec![0.0; n]);
        let power: f64 = (0..n).map(|k| (torque[k] - gravity[k]) * SPEED[k]).sum();
        assert!((change - power).abs() < 1e-8 * power.abs().max(1.0), "{change} and {power}");
    }
}

#[test]
fn torques_are_the_regressor_times_the_parameters() {
    for arm in arms() {
        let n = arm.tree.coordinates;
        let (position, speed, acceleration) = (&POSITION[..n], &SPEED[..n], &ACCELERATION[..n]);
        let matrix = regressor(&mut Numbers, &arm.tree, GRAVITY, position, speed, acceleration);
        let parameters = arm.parameters.as_flattened();
        let product = |row: &Vec<f64>| row.iter().zip(parameters).map(|(x, y)| x * y).sum();
        let torque: Vec<f64> = matrix.iter().map(product).collect();
        assert_close(&torque, &arm.torque(position, speed, acceleration), 1e-13);
    }
}

#[test]
fn a_coupled_joint_adds_its_torque_times_its_ratio() {
    let coupled = gripper();
    let mut free = coupled.clone();
    for joint in &mut free.joints {
        joint.coupling = None;
    }
    let (q, w, e) = ([0.3, 0.07], [0.5, -0.4], [1.0, 2.0]);
    let along = |x: [f64; 2]| [x[0], x[1], -2.0 * x[1], -6.0 * x[1]];
    let position = [q[0], q[1], -2.0 * q[1] + 0.05, 3.0 * (-2.0 * q[1] + 0.05) + 0.1];
    let arm = Arm::new(&free, &["turn", "left_finger", "right_finger", "tip_joint"]);
    let torque = arm.torque(&position, &along(w), &along(e));
    let expected = [torque[0], torque[1] - 2.0 * torque[2] - 6.0 * torque[3]];
    let result = Arm::new(&coupled, &["turn", "left_finger"]).torque(&q, &w, &e);
    assert_close(&result, &expected, 1e-13);
}

#[test]
fn a_locked_joint_is_equivalent_to_one_at_rest() {
    let robot = general_arm();
    let all = Arm::new(&robot, &["shoulder", "slider", "wrist"]);
    let locked = [("slider".to_owned(), 0.35)].into();
    let tree = Tree::new(&robot, &names(&["shoulder", "wrist"]), &locked).expect("the tree is valid");
    let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(&robot));
    let result = inverse_dynamics(
        &mut Numbers,
        &tree,
        &parameters,
        GRAVITY,
        &[0.4, 0.9],
        &[1.2, 0.5],
        &[-2.0, FRAC_PI_2],
    );
    let torque = all.torque(&[0.4, 0.35, 0.9], &[1.2, 0.0, 0.5], &[-2.0, 0.0, FRAC_PI_2]);
    assert_close(&result, &[torque[0], torque[2]], 1e-13);
}

#[test]
fn derivatives_of_the_torques_agree_with_differences() {
    for arm in arms() {
        let n = arm.tree.coordinates;
        let motion = [&POSITION[..n], &SPEED[..n], &ACCELERATION[..n]];
        let (tree, parameters) = (&arm.tree, &arm.parameters);
        let [position, speed, acceleration] = motion;
        let exact = inverse_dynamics_derivatives(
            &mut Numbers,
            tree,
            parameters,
            GRAVITY,
            position,
            speed,
            acceleration,
        );
        assert_close(&exact.torque, &arm.torque(position, speed, acceleration), 1e-14);
        for (kind, derivatives) in [exact.position, exact.speed, exact.acceleration].iter().enumerate() {
            for column in 0..n {
                let torque_at = |step: f64| {
                    let mut changed = motion.map(<[f64]>::to_vec);
                    changed[kind][column] += step;
                    arm.torque(&changed[0], &changed[1], &changed[2])
                };
                // Central differences of fourth order.
                let step = 1e-3;
                let [far, near] = [2.0, 1.0].map(|k| {
                    let (after, before) = (torque_at(k * step), torque_at(-k * step));
                    after.iter().zip(&before).map(|(x, y)| x - y).collect::<Vec<f64>>()
                });
                let differences: Vec<f64> =
                    (0..n).map(|k| (8.0 * near[k] - far[k]) / (12.0 * step)).collect();
                let values: Vec<f64> = (0..n).map(|row| derivatives[row * n + column]).collect();
                assert_close(&values, &differences, 1e-10);
            }
        }
    }
}

#[test]
fn lanes_give_the_results_of_single_numbers() {
    for arm in arms() {
        let n = arm.tree.coordinates;
        let sample = |lane: usize, motion: &[f64]| -> Vec<f64> {
            motion[..n].iter().map(|x| x + lane as f64).collect()
        };
        let spread = |motion: &[f64]| -> Vec<[f64; 4]> {
            (0..n).map(|k| std::array::from_fn(|lane| sample(lane, motion)[k])).collect()
        };
        let parameters: Vec<_> = arm.parameters.iter().map(|body| body.map(|value| [value; 4])).collect();
        let lanes = inverse_dynamics_derivatives(
            &mut Lanes::<4>,
            &arm.tree,
            &parameters,
            GRAVITY.map(|g| [g; 4]),
            &spread(&POSITION),
            &spread(&SPEED),
            &spread(&ACCELERATION),
        );
        for lane in 0..4 {
            let [position, speed, acceleration] = [POSITION, SPEED, ACCELERATION].map(|x| sample(lane, &x));
            let (tree, parameters) = (&arm.tree, &arm.parameters);
            let single = inverse_dynamics_derivatives(
                &mut Numbers,
                tree,
                parameters,
                GRAVITY,
                &position,
                &speed,
                &acceleration,
            );
            let values: Vec<f64> = lanes.position.iter().map(|value| value[lane]).collect();
            assert_close(&values, &single.position, 1e-14);
            let values: Vec<f64> = lanes.torque.iter().map(|value| value[lane]).collect();
            assert_close(&values, &single.torque, 1e-14);
        }
    }
}
