//! Contract: the dynamics of ten description files agree with Pinocchio and MuJoCo to 1e-10 of the largest value.
//!
//! The golden values were written by `fixtures/robots/golden.py`.

use std::collections::BTreeMap;

use augsim_robot::description::Format;
use augsim_robot::{
    Numbers, Robot, Tree, forward_dynamics, inverse_dynamics, inverse_dynamics_derivatives, mass_matrix,
    read, regressor,
};

use crate::fixture;
use crate::shared_data::shared_data;

/// Values of one robot.
#[derive(serde::Deserialize)]
struct Golden {
    file: String,
    is_committed: bool,
    /// Moving joints, in the order of the coordinates.
    joints: Vec<String>,
    /// Joints of the bodies, coupled ones included, in the order of the parameters and of the regressor's columns.
    bodies: Vec<String>,
    parameters: Vec<[f64; 10]>,
    gravity: [f64; 3],
    states: Vec<State>,
}

/// Values at one state; matrices are by rows.
#[derive(serde::Deserialize)]
struct State {
    position: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
    applied: Vec<f64>,
    inverse: Vec<f64>,
    /// Accelerations under the torques `applied`; empty where the mass matrix is singular.
    forward: Vec<f64>,
    mass_matrix: Vec<Vec<f64>>,
    regressor: Vec<Vec<f64>>,
    by_position: Vec<Vec<f64>>,
    by_speed: Vec<Vec<f64>>,
}

/// A robot and its golden values.
struct Case {
    golden: Golden,
    robot: Robot,
    tree: Tree,
    /// Index of the golden body of each body of the tree.
    order: Vec<usize>,
}

/// All robots whose files are at hand.
fn cases() -> Vec<Case> {
    let goldens: Vec<Golden> =
        serde_json::from_str(&fixture("golden.json")).expect("the golden file is valid");
    assert_eq!(goldens.len(), 10);
    goldens.into_iter().filter_map(case).collect()
}

/// A robot with its file; `None` if the file is not at hand.
fn case(golden: Golden) -> Option<Case> {
    let text = if golden.is_committed {
        fixture(&golden.file)
    } else {
        std::fs::read_to_string(shared_data(&golden.file)?).expect("the file is readable")
    };
    let robot = read(&text, &golden.file).expect("the description is valid");
    let tree = Tree::new(&robot, &golden.joints, &BTreeMap::new()).expect("the tree is valid");
    let position = |name: &str| golden.bodies.iter().position(|body| body == name).expect("a golden body");
    let order = tree.bodies.iter().map(|body| position(&robot.joints[body.joint].name)).collect();
    Some(Case { golden, robot, tree, order })
}

impl Case {
    /// The golden parameters, in the order of the tree.
    fn parameters(&self) -> Vec<[f64; 10]> {
        self.order.iter().map(|&body| self.golden.parameters[body]).collect()
    }

    fn assert_close(&self, quantity: &str, values: &[f64], expected: &[f64], tolerance: f64) {
        assert_eq!(values.len(), expected.len(), "{} {quantity}", self.golden.file);
        let scale = expected.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        for (value, expected) in values.iter().zip(expected) {
            let error = (value - expected).abs();
            assert!(
                error <= tolerance * scale,
                "{} {quantity}: {value} in place of {expected}",
                self.golden.file
            );
        }
    }
}

#[test]
fn inertial_parameters_of_the_bodies_agree() {
    for case in cases() {
        let links = case.tree.link_parameters(&case.robot);
        let bodies = case.tree.body_parameters(&mut Numbers, &links);
        // MuJoCo diagonalises the tensors with errors of this size.
        let tolerance = if case.robot.format == Format::Mjcf { 1e-5 } else { 1e-10 };
        for (body, golden) in bodies.iter().zip(case.parameters()) {
            case.assert_close("mass", &body[..1], &golden[..1], 1e-10);
            case.assert_close("moment", &body[1..4], &golden[1..4], 1e-10);
            case.assert_close("tensor", &body[4..], &golden[4..], tolerance);
        }
    }
}

#[test]
fn torques_and_accelerations_agree() {
    for case in cases() {
        let (tree, parameters, gravity) = (&case.tree, case.parameters(), case.golden.gravity);
        let armature = tree.armature(&case.robot);
        for state in &case.golden.states {
            let State { position, speed, acceleration, applied, .. } = state;
            let torque =
                inverse_dynamics(&mut Numbers, tree, &parameters, gravity, position, speed, acceleration);
            case.assert_close("inverse", &torque, &state.inverse, 1e-10);
            let matrix = mass_matrix(&mut Numbers, tree, &parameters, &armature, position);
            case.assert_close("mass matrix", &matrix.concat(), &state.mass_matrix.concat(), 1e-10);
            let result = forward_dynamics(
                &mut Numbers,
                tree,
                &parameters,
                gravity,
                &armature,
                position,
                speed,
                applied,
            );
            if !state.forward.is_empty() {
                case.assert_close("forward", &result, &state.forward, 1e-10);
            }
        }
    }
}

#[test]
fn regressors_agree() {
    for case in cases() {
        for state in &case.golden.states {
            let State { position, speed, acceleration, .. } = state;
            let gravity = case.golden.gravity;
            let matrix = regressor(&mut Numbers, &case.tree, gravity, position, speed, acceleration);
            for (row, golden) in matrix.iter().zip(&state.regressor) {
                let expected: Vec<f64> =
                    case.order.iter().flat_map(|&body| golden[10 * body..][..10].to_vec()).collect();
                case.assert_close("regressor", row, &expected, 1e-10);
            }
        }
    }
}

#[test]
fn derivatives_of_the_torques_agree() {
    for case in cases() {
        let (tree, parameters, gravity) = (&case.tree, case.parameters(), case.golden.gravity);
        let armature = tree.armature(&case.robot);
        for state in &case.golden.states {
            let State { position, speed, acceleration, .. } = state;
            let mut result = inverse_dynamics_derivatives(
                &mut Numbers,
                tree,
                &parameters,
                gravity,
                position,
                speed,
                acceleration,
            );
            case.assert_close("torque", &result.torque, &state.inverse, 1e-10);
            case.assert_close("derivative by position", &result.position, &state.by_position.concat(), 1e-10);
            case.assert_close("derivative by speed", &result.speed, &state.by_speed.concat(), 1e-10);
            for (k, armature) in armature.iter().enumerate() {
                result.acceleration[k * (tree.coordinates + 1)] += armature;
            }
            case.assert_close("mass matrix", &result.acceleration, &state.mass_matrix.concat(), 1e-10);
        }
    }
}
