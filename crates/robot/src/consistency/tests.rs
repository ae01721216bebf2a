//! Contract: parameters are consistent exactly if bodies of positive density have them, and identified combinations are kept by
//! consistent parameters wherever such parameters exist.
use super::*;
use crate::test_random::Random;
use approx::assert_relative_eq;

/// Parameters of point masses: kg and m. Four or more that are not in a plane are consistent.
fn of_points(points: &[(f64, [f64; 3])]) -> Parameters {
    let mut p = [0.0; 10];
    for (m, [x, y, z]) in points {
        let square = x * x + y * y + z * z;
        let moments =
            [1.0, *x, *y, *z, square - x * x, -x * y, -x * z, square - y * y, -y * z, square - z * z];
        p.iter_mut().zip(moments).for_each(|(p, moment)| *p += m * moment);
    }
    p
}

/// A body of seven masses.
fn body(seed: u64) -> Parameters {
    let mut random = Random(seed);
    let mut point =
        || (0.2 + random.uniform(), [0.0, 0.1, -0.2].map(|centre| centre + 0.5 * (random.uniform() - 0.5)));
    of_points(&(0..7).map(|_| point()).collect::<Vec<_>>())
}

#[test]
fn bodies_of_masses_are_consistent_and_impossible_ones_are_not() {
    assert!((0..20).all(|seed| is_consistent(&body(seed))));
    let with = |index: usize, value: f64| {
        let mut parameters = of_points(&[
            (1.0, [0.1; 3]),
            (1.0, [-0.1, 0.1, 0.0]),
            (1.0, [0.0, -0.1, 0.1]),
            (1.0, [0.1, 0.0, -0.1]),
        ]);
        assert!(is_consistent(&parameters));
        parameters[index] = value;
        parameters
    };
    assert!(!is_consistent(&with(0, -1.0)), "negative mass");
    assert!(
        !is_consistent(&with(1, 5.0)),
        "a centre of mass so far away that its inertia about the origin is larger"
    );
    assert!(!is_consistent(&with(4, 1.0)), "Ixx above Iyy + Izz");
    assert!(!is_consistent(&with(5, 0.2)), "a product of inertia above the moments");
    assert!(!is_consistent(&with(9, f64::NAN)));
    assert!(!is_consistent(&of_points(&[(1.0, [0.1, 0.2, 0.3])])), "a point");
}

#[test]
fn the_pseudo_inertia_holds_the_moments_of_the_masses() {
    let j = pseudo_inertia(&of_points(&[(2.0, [1.0, 3.0, 5.0])]));
    let x = [1.0, 3.0, 5.0, 1.0];
    for (i, k) in (0..4).flat_map(|i| (0..4).map(move |k| (i, k))) {
        assert_relative_eq!(j[i][k], 2.0 * x[i] * x[k], epsilon = 1e-12);
    }
}

#[test]
fn log_cholesky_coordinates_lead_back_to_the_parameters() {
    for seed in 0..20 {
        let parameters = body(seed);
        let coordinates = log_cholesky(&parameters).expect("consistent");
        for (found, value) in from_log_cholesky(&coordinates).iter().zip(parameters) {
            assert_relative_eq!(*found, value, epsilon = 1e-12);
        }
    }
    let any = [0.3, -2.0, -1.0, -3.0, 0.1, -0.2, 0.05, 0.4, -0.3, 0.2];
    for (found, value) in log_cholesky(&from_log_cholesky(&any)).expect("consistent").iter().zip(any) {
        assert_relative_eq!(*found, value, epsilon = 1e-12);
    }
}

#[test]
fn derivatives_equal_finite_differences() {
    for seed in 0..5 {
        let coordinates = log_cholesky(&body(seed)).expect("consistent");
        let derivatives = parameter_derivatives(&coordinates);
        for k in 0..10 {
            let moved = |step: f64| {
                let mut moved = coordinates;
                moved[k] += step;
                from_log_cholesky(&moved)
            };
            let (above, below) = (moved(1e-5), moved(-1e-5));
            for i in 0..10 {
                assert_relative_eq!(derivatives[i][k], (above[i] - below[i]) / 2e-5, epsilon = 1e-8);
            }
        }
    }
}

#[test]
fn parameters_of_a_rod_are_raised_as_little_as_needed() {
    let rod = of_points(&[(1.0, [0.0; 3]), (1.0, [0.6, 0.0, 0.0])]);
    let raised = raise_to_consistent(&rod, 1e-3, 0.01).expect("finite");
    assert!(is_consistent(&raised));
    assert_relative_eq!(raised[0], 2.0, epsilon = 1e-12);
    assert_relative_eq!(raised[1], 0.6, epsilon = 1e-12);
    // Two thin directions, each with 2 kg * (0.01 m)^2.
    assert_relative_eq!(raised[4], 4e-4, epsilon = 1e-12);
    assert_relative_eq!(raised[7] - rod[7], 2e-4, epsilon = 1e-12);
    assert!(is_consistent(&raise_to_consistent(&[0.0; 10], 1e-3, 0.01).expect("finite")));
    assert_eq!(raise_to_consistent(&body(3), 1e-3, 0.01), Some(body(3)));
    assert_eq!(raise_to_consistent(&[f64::NAN; 10], 1e-3, 0.01), None);
}

/// Factors of 8 combinations of the parameters of two bodies, with entries between -1 and 1.
fn factors() -> Vec<Vec<f64>> {
    (0..8)
        .map(|i| (0..20).map(|j| f64::from((i * 17 + j * j * 5 + i * j * 3) % 41) / 20.5 - 1.0).collect())
        .collect()
}

fn estimate(truth: &[Parameters], sd: f64) -> BaseEstimate {
    let parameters: Vec<f64> = truth.iter().flatten().copied().collect();
    let factors = factors();
    // Errors of half a standard deviation with alternating signs.
    let values = factors.iter().enumerate().map(|(k, row)| {
        let exact: f64 = row.iter().zip(&parameters).map(|(f, p)| f * p).sum();
        exact + if k % 2 == 0 { 0.5 * sd } else { -0.5 * sd }
    });
    let values = values.collect();
    let covariance = (0..8).map(|i| (0..8).map(|j| if i == j { sd * sd } else { 0.0 }).collect()).collect();
    BaseEstimate { factors, values, covariance }
}

#[test]
fn identified_combinations_are_kept_by_consistent_parameters_close_to_the_prior() {
    for seed in 0..10 {
        let truth = [body(seed), body(seed + 50)];
        let prior = [body(seed + 100), body(seed + 150)];
        for sd in [1e-2, 1e-5] {
            let estimate = estimate(&truth, sd);
            let found = nearest_consistent(&estimate, &prior).expect("well posed");
            assert!(found.is_within_uncertainty, "{seed} {sd}: {}", found.chi_square);
            assert!(found.parameters.iter().all(is_consistent));
            for (k, row) in estimate.factors.iter().enumerate() {
                let value: f64 = row.iter().zip(found.parameters.iter().flatten()).map(|(f, p)| f * p).sum();
                assert!((value - estimate.values[k]).abs() < 8.0_f64.sqrt() * sd);
            }
        }
    }
}

#[test]
fn parameters_without_information_stay_at_the_prior() {
    // Only the first moments and the mass of the first body are identified.
    let truth = [body(1), body(2)];
    let prior = [body(3), body(4)];
    let mut estimate = estimate(&truth, 1e-4);
    estimate.factors =
        (0..8).map(|k| (0..20).map(|j| if k < 4 && j == k { 1.0 } else { 0.0 }).collect()).collect();
    estimate.values = (0..8).map(|k| if k < 4 { truth[0][k] } else { 0.0 }).collect();
    let found = nearest_consistent(&estimate, &prior).expect("well posed");
    for (found, value) in found.parameters[0].iter().zip(&truth[0][..4]) {
        assert_relative_eq!(*found, *value, epsilon = 3e-4);
    }
    for (found, value) in found.parameters[1].iter().zip(prior[1]) {
        assert_relative_eq!(*found, value, epsilon = 1e-9);
    }
}

#[test]
fn a_prior_that_agrees_is_returned_and_impossible_values_are_reported() {
    let truth = [body(5), body(6)];
    let found = nearest_consistent(&estimate(&truth, 1e-3), &truth).expect("well posed");
    assert!(found.squared_distance < 1e-12);
    // The mass of the first body is identified as -1 kg: consistent parameters can only approach 0.
    let mut impossible = estimate(&truth, 1e-2);
    impossible.factors[0] = (0..20).map(|j| if j == 0 { 1.0 } else { 0.0 }).collect();
    impossible.values[0] = -1.0;
    let found = nearest_consistent(&impossible, &truth).expect("well posed");
    assert!(!found.is_within_uncertainty && found.chi_square > 9000.0);
    assert!(found.parameters.iter().all(is_consistent));
}

#[test]
fn wrong_input_is_named() {
    let truth = [body(5), body(6)];
    let good = estimate(&truth, 1e-3);
    let message = |change: &dyn Fn(&mut BaseEstimate)| {
        let mut estimate = good.clone();
        change(&mut estimate);
        nearest_consistent(&estimate, &truth).expect_err("refused").to_string()
    };
    assert!(message(&|e| e.values[3] = f64::NAN).starts_with("row 3 of the base parameters"));
    assert!(message(&|e| e.covariance[0][0] = -1.0).contains("not positive definite"));
    assert!(message(&|e| e.factors[0].truncate(19)).contains("8 rows of 20 factors"));
    let error = nearest_consistent(&good, &[truth[0], [0.0; 10]]).expect_err("no mass");
    assert_eq!(error, ConsistencyError::PriorInconsistent { body: 1 });
}
