//! Contract: estimates have the errors that their covariance states; joints count by their noise; noise in the regressor biases
//! least squares and does not bias instrumental variables.
//!
//! The equations are those of two joints with 6 parameters, of which two act only by their sum.
use super::*;
use crate::base_parameters::{Independence, ROUNDING, base_parameters};
use crate::test_random::Random;
use approx::assert_relative_eq;

const TRUTH: [f64; 6] = [2.0, -1.0, 0.5, 0.3, 3.0, 0.8];
/// Standard deviations of the torques of the two joints.
const NOISE: [f64; 2] = [1.0, 0.02];

/// Rows of both joints at a state of two angles, speeds and accelerations that change with time; the last two columns are
/// proportional.
fn rows(random: &mut Random) -> [Vec<f64>; 2] {
    let [a, b, c, d, e] = std::array::from_fn(|_| 2.0 * random.uniform() - 1.0);
    [vec![a, b, a * b, c, d, 0.5 * d], vec![0.0, a, b - a, e, c, 0.5 * c]]
}

fn torque(row: &[f64]) -> f64 {
    row.iter().zip(TRUTH).map(|(x, value)| x * value).sum()
}

struct Simulated {
    joints: Vec<JointEquations>,
    products: Vec<InstrumentProducts>,
}

/// Equations whose regressors have errors of this standard deviation; the instruments have none.
fn simulate(seed: u64, regressor_noise: f64) -> Simulated {
    let mut random = Random(seed);
    let mut simulated =
        Simulated { joints: vec![JointEquations::new(6); 2], products: vec![InstrumentProducts::new(6); 2] };
    for _ in 0..400 {
        let exact = rows(&mut random);
        for (joint, exact) in exact.iter().enumerate() {
            let measured_torque = torque(exact) + NOISE[joint] * random.normal();
            let mut measured: Vec<f64> = exact
                .iter()
                .map(|x| if *x == 0.0 { 0.0 } else { x + regressor_noise * random.normal() })
                .collect();
            measured[5] = 0.5 * measured[4];
            simulated.joints[joint].add(&measured, measured_torque);
            simulated.products[joint].add(exact, &measured, measured_torque);
        }
    }
    simulated
}

fn base(joints: &[JointEquations]) -> BaseParameters {
    let names: Vec<String> = (0..6).map(|k| format!("p{k}")).collect();
    base_parameters(&stacked_regressor(joints, &NOISE), &names, &Independence::Share(ROUNDING))
}

#[test]
fn estimates_are_as_accurate_as_their_covariance_states() {
    let mut sum = [0.0; 5];
    for seed in 0..200 {
        let simulated = simulate(seed, 0.0);
        let base = base(&simulated.joints);
        assert_eq!(base.combination_text(4), "p4 + 0.5 p5");
        let found = weighted_least_squares(&simulated.joints, &base).expect("determined");
        let truth = base.values(&TRUTH);
        for (k, sd) in found.standard_deviations().iter().enumerate() {
            sum[k] += ((found.values[k] - truth[k]) / sd).powi(2) / 200.0;
        }
    }
    for mean_square in sum {
        assert!((0.7..1.4).contains(&mean_square), "squared error over variance: {mean_square}");
    }
}

#[test]
fn a_noisy_joint_counts_less_and_its_noise_is_estimated() {
    let simulated = simulate(1, 0.0);
    let base = base(&simulated.joints);
    let found = weighted_least_squares(&simulated.joints, &base).expect("determined");
    for (sd, noise) in found.residual_sd.iter().zip(NOISE) {
        assert_relative_eq!(*sd, noise, max_relative = 0.1);
    }
    // p1 acts on both joints: the precise one determines it, with an error of about 0.02 / sqrt(400 / 3) of it.
    assert!(found.standard_deviations()[1] < 0.004);
}

#[test]
fn noise_in_the_regressor_biases_least_squares_and_not_instrumental_variables() {
    let (mut worst_least_squares, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
    for seed in 0..50 {
        let simulated = simulate(seed, 0.2);
        let base = base(&simulated.joints);
        let truth = base.values(&TRUTH);
        let least_squares = weighted_least_squares(&simulated.joints, &base).expect("determined");
        let found = instrumental_variables(&simulated.products, &base, &least_squares.residual_sd)
            .expect("determined");
        let sd = found.standard_deviations();
        for k in 0..5 {
            worst_least_squares = worst_least_squares
                .max((least_squares.values[k] - truth[k]).abs() / least_squares.standard_deviations()[k]);
            sum += ((found.values[k] - truth[k]) / sd[k]).powi(2);
            count += 1.0;
        }
    }
    assert!(worst_least_squares > 5.0, "{worst_least_squares}");
    let mean_square: f64 = sum / count;
    assert!((0.6..1.6).contains(&mean_square), "squared error over variance: {mean_square}");
}

#[test]
fn both_estimates_agree_without_noise_in_the_regressor() {
    let simulated = simulate(3, 0.0);
    let base = base(&simulated.joints);
    let least_squares = weighted_least_squares(&simulated.joints, &base).expect("determined");
    let instruments =
        instrumental_variables(&simulated.products, &base, &least_squares.residual_sd).expect("determined");
    for k in 0..5 {
        assert_relative_eq!(least_squares.values[k], instruments.values[k], epsilon = 1e-9);
        assert_relative_eq!(
            least_squares.covariance[k][k],
            instruments.covariance[k][k],
            max_relative = 1e-6
        );
    }
}

#[test]
fn exact_data_give_exact_parameters_and_missing_data_are_named() {
    let mut joints = vec![JointEquations::new(6); 2];
    let mut random = Random(7);
    for _ in 0..20 {
        for (joint, row) in rows(&mut random).iter().enumerate() {
            joints[joint].add(row, torque(row));
        }
    }
    let base = base(&joints);
    let found = weighted_least_squares(&joints, &base).expect("determined");
    for (value, truth) in found.values.iter().zip(base.values(&TRUTH)) {
        assert_relative_eq!(*value, truth, epsilon = 1e-9);
    }
    // The second joint alone knows nothing of p0.
    let error = weighted_least_squares(&joints[1..], &base).expect_err("not determined");
    assert_eq!(error, LeastSquaresError::Singular { combination: "p0".to_string() });
    let few = weighted_least_squares(&[JointEquations::new(6)], &base).expect_err("no equations");
    assert_eq!(few, LeastSquaresError::TooFewEquations { equations: 0, parameters: 5 });
}
