//! Contract: factors 0 and 1 of the description are left out of the equations, which changes their length and no result.

use std::collections::BTreeMap;

use augsim_robot::{Algebra, Numbers, Tree, forward_dynamics, inverse_dynamics, read};

use crate::arms::{elbow_arm, general_arm, gripper};
use crate::fixture;

/// Counts operations between values that are not constant, as an expression graph would hold them.
#[derive(Default)]
struct Count {
    operations: usize,
}

impl Count {
    /// A constant if both values are, and an operation otherwise.
    fn result(&mut self, a: Option<f64>, b: Option<f64>, f: impl Fn(f64, f64) -> f64) -> Option<f64> {
        let constant = Option::zip(a, b).map(|(a, b)| f(a, b));
        self.operations += usize::from(constant.is_none());
        constant
    }
}

impl Algebra for Count {
    /// A constant, or something that depends on the state.
    type Value = Option<f64>;

    fn constant(&mut self, value: f64) -> Option<f64> {
        Some(value)
    }
    fn add(&mut self, a: Option<f64>, b: Option<f64>) -> Option<f64> {
        match (a, b) {
            (Some(0.0), other) | (other, Some(0.0)) => other,
            _ => self.result(a, b, |a, b| a + b),
        }
    }
    fn subtract(&mut self, a: Option<f64>, b: Option<f64>) -> Option<f64> {
        match (a, b) {
            (a, Some(0.0)) => a,
            _ => self.result(a, b, |a, b| a - b),
        }
    }
    fn multiply(&mut self, a: Option<f64>, b: Option<f64>) -> Option<f64> {
        match (a, b) {
            (Some(0.0), _) | (_, Some(0.0)) => Some(0.0),
            (Some(1.0), other) | (other, Some(1.0)) => other,
            _ => self.result(a, b, |a, b| a * b),
        }
    }
    fn divide(&mut self, a: Option<f64>, b: Option<f64>) -> Option<f64> {
        self.result(a, b, |a, b| a / b)
    }
    fn negate(&mut self, a: Option<f64>) -> Option<f64> {
        self.result(a, Some(0.0), |a, _| -a)
    }
    fn sin(&mut self, a: Option<f64>) -> Option<f64> {
        self.result(a, Some(0.0), |a, _| a.sin())
    }
    fn cos(&mut self, a: Option<f64>) -> Option<f64> {
        self.result(a, Some(0.0), |a, _| a.cos())
    }
}

#[test]
fn leaving_out_constants_changes_no_result() {
    for arm in [general_arm(), elbow_arm(), gripper()] {
        let joints: Vec<String> = arm
            .joints
            .iter()
            .filter(|joint| joint.coupling.is_none())
            .map(|joint| joint.name.clone())
            .collect();
        let tree = Tree::new(&arm, &joints, &BTreeMap::new()).expect("the tree is valid");
        let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(&arm));
        let state: Vec<f64> = (0..joints.len()).map(|k| 0.7 - 0.4 * k as f64).collect();
        let (gravity, armature) = ([0.5, -1.0, -9.7], vec![0.2; joints.len()]);
        let expected =
            forward_dynamics(&mut Numbers, &tree, &parameters, gravity, &armature, &state, &state, &state);
        // Constants take the place of the state, so that the counting arithmetic computes numbers.
        let known = |values: &[f64]| -> Vec<Option<f64>> { values.iter().copied().map(Some).collect() };
        let count = &mut Count::default();
        let parameters = tree.body_parameters(count, &constants(&tree.link_parameters(&arm)));
        let state = known(&state);
        let result = forward_dynamics(
            count,
            &tree,
            &parameters,
            gravity.map(Some),
            &known(&armature),
            &state,
            &state,
            &state,
        );
        for (result, expected) in result.iter().zip(&expected) {
            let result = result.expect("a number");
            assert!((result - expected).abs() < 1e-12 * expected.abs().max(1.0), "{result} and {expected}");
        }
    }
}

/// Parameters as constants of the counting arithmetic.
fn constants(parameters: &[[f64; 10]]) -> Vec<[Option<f64>; 10]> {
    parameters.iter().map(|parameters| parameters.map(Some)).collect()
}

#[test]
fn the_equations_of_a_seven_axis_arm_take_few_operations() {
    let robot =
        read(&fixture("seven-axis-arm.urdf"), "seven-axis-arm.urdf").expect("the description is valid");
    let joints: Vec<String> = (1..=7).map(|k| format!("joint{k}")).collect();
    let tree = Tree::new(&robot, &joints, &BTreeMap::new()).expect("the tree is valid");
    let parameters = constants(&tree.body_parameters(&mut Numbers, &tree.link_parameters(&robot)));
    let (gravity, state) = ([0.0, 0.0, -9.81].map(Some), [None; 7]);
    let mut inverse = Count::default();
    inverse_dynamics(&mut inverse, &tree, &parameters, gravity, &state, &state, &state);
    assert!(inverse.operations <= 900, "{} operations", inverse.operations);
    let mut forward = Count::default();
    let armature = [0.1; 7].map(Some);
    forward_dynamics(&mut forward, &tree, &parameters, gravity, &armature, &state, &state, &state);
    assert!(forward.operations <= 1800, "{} operations", forward.operations);
}
