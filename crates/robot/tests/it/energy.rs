//! Contract: an arm without friction keeps its energy.

use std::collections::BTreeMap;

use augsim_robot::{Numbers, Tree, forward_dynamics, inverse_dynamics, mass_matrix};

use crate::arms::{elbow_arm, names};

const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// An arm of three revolute joints, with the parameters of its bodies.
struct Arm {
    tree: Tree,
    parameters: Vec<[f64; 10]>,
}

impl Arm {
    /// Positions and speeds (rad/s) per time.
    fn rates(&self, state: [f64; 6]) -> [f64; 6] {
        let (position, speed) = state.split_at(3);
        let none = [0.0; 3];
        let acceleration = forward_dynamics(
            &mut Numbers,
            &self.tree,
            &self.parameters,
            GRAVITY,
            &none,
            position,
            speed,
            &none,
        );
        [speed[0], speed[1], speed[2], acceleration[0], acceleration[1], acceleration[2]]
    }

    /// State after a step of the classical Runge-Kutta method of fourth order.
    fn after_step(&self, state: [f64; 6], step: f64) -> [f64; 6] {
        let along = |rates: [f64; 6], time: f64| std::array::from_fn(|k| state[k] + time * rates[k]);
        let first = self.rates(state);
        let second = self.rates(along(first, 0.5 * step));
        let third = self.rates(along(second, 0.5 * step));
        let fourth = self.rates(along(third, step));
        let mean = std::array::from_fn(|k| (first[k] + 2.0 * (second[k] + third[k]) + fourth[k]) / 6.0);
        along(mean, step)
    }

    /// Kinetic energy, J.
    fn kinetic_energy(&self, state: [f64; 6]) -> f64 {
        let (position, speed) = state.split_at(3);
        let matrix = mass_matrix(&mut Numbers, &self.tree, &self.parameters, &[0.0; 3], position);
        let momentum = matrix.iter().map(|row| row.iter().zip(speed).map(|(m, w)| m * w).sum::<f64>());
        0.5 * momentum.zip(speed).map(|(p, w)| p * w).sum::<f64>()
    }

    /// Potential energy against the position 0, J: the work of the torques that hold the arm against gravity.
    fn potential_energy(&self, state: [f64; 6]) -> f64 {
        // Along the straight path from 0 to the position.
        let position = &state[..3];
        let power = |share: f64| {
            let at: Vec<f64> = position.iter().map(|q| share * q).collect();
            let zero = [0.0; 3];
            let torque =
                inverse_dynamics(&mut Numbers, &self.tree, &self.parameters, GRAVITY, &at, &zero, &zero);
            torque.iter().zip(position).map(|(t, q)| t * q).sum::<f64>()
        };
        gauss_legendre(power)
    }
}

/// Integral from 0 to 1, by 200 pieces with three points each.
fn gauss_legendre(f: impl Fn(f64) -> f64) -> f64 {
    let pieces = 200;
    let width = 1.0 / f64::from(pieces);
    let piece = |k: i32| {
        let middle = (f64::from(k) + 0.5) * width;
        let offset = 0.5 * width * 0.6_f64.sqrt();
        width / 18.0 * (5.0 * f(middle - offset) + 8.0 * f(middle) + 5.0 * f(middle + offset))
    };
    (0..pieces).map(piece).sum()
}

#[test]
fn a_frictionless_arm_keeps_its_energy_for_ten_seconds() {
    let robot = elbow_arm();
    let tree =
        Tree::new(&robot, &names(&["shoulder", "slider", "wrist"]), &BTreeMap::new()).expect("a valid tree");
    let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(&robot));
    let arm = Arm { tree, parameters };
    let start = [0.5, 0.8, -0.4, 0.3, -0.5, 1.0];
    let energy = |state| arm.kinetic_energy(state) + arm.potential_energy(state);
    let (mut state, step) = (start, 2e-4);
    let mut largest = 0.0_f64;
    let begin = energy(start);
    for index in 1..=50_000 {
        state = arm.after_step(state, step);
        if index % 10_000 == 0 {
            largest = largest.max((energy(state) - begin).abs());
        }
    }
    let scale = arm.kinetic_energy(state).max(arm.potential_energy(state).abs());
    assert!(scale > 1.0, "the arm moves");
    assert!(largest <= 1e-9 * scale, "energy changed by {largest} J of {scale} J");
}
