//! Contract: the combinations of a planar arm of two joints are those of the textbooks, and their columns alone give its
//! torques.
//!
//! The regressor was derived by hand from the Lagrangian (Spong, Hutchinson and Vidyasagar 2006, 7.3). The arm moves in a
//! vertical plane.
use super::*;
use approx::assert_relative_eq;

const LENGTH: f64 = 0.4;
const NAMES: [&str; 11] = [
    "link1_mass",
    "link1_moment_x",
    "link1_moment_y",
    "link1_inertia_zz",
    "link1_inertia_xx",
    "joint1_armature",
    "link2_mass",
    "link2_moment_x",
    "link2_moment_y",
    "link2_inertia_zz",
    "joint2_armature",
];

fn names() -> Vec<String> {
    NAMES.iter().map(|name| name.to_string()).collect()
}

/// Rows of both joints, `[2][11]`; `gravity` along -y, m/s2.
fn regressor(gravity: f64, q: &[f64], w: &[f64], a: &[f64]) -> Vec<f64> {
    let (l, g) = (LENGTH, gravity);
    let (c1, s1, c2, s2) = (q[0].cos(), q[0].sin(), q[1].cos(), q[1].sin());
    let (c12, s12) = ((q[0] + q[1]).cos(), (q[0] + q[1]).sin());
    let (sum, product) = (2.0 * a[0] + a[1], w[1] * (2.0 * w[0] + w[1]));
    let both = a[0] + a[1];
    vec![
        0.0,
        g * c1,
        -g * s1,
        a[0],
        0.0,
        a[0],
        l * l * a[0] + g * l * c1,
        l * c2 * sum - l * s2 * product + g * c12,
        -l * s2 * sum - l * c2 * product - g * s12,
        both,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        l * c2 * a[0] + l * s2 * w[0] * w[0] + g * c12,
        -l * s2 * a[0] + l * c2 * w[0] * w[0] - g * s12,
        both,
        a[1],
    ]
}

fn texts(base: &BaseParameters) -> Vec<String> {
    (0..base.independent.len()).map(|k| base.combination_text(k)).collect()
}

const RANGES: [[f64; 2]; 2] = [[-3.0, 3.0]; 2];

#[test]
fn a_planar_arm_under_gravity_has_the_combinations_of_the_textbook() {
    let base = structurally_identifiable(&names(), &RANGES, |q, w, a| regressor(9.81, q, w, a));
    assert_eq!(
        texts(&base),
        [
            "link1_moment_x + 0.4 link2_mass",
            "link1_moment_y",
            "link1_inertia_zz + joint1_armature + 0.16 link2_mass",
            "link2_moment_x",
            "link2_moment_y",
            "link2_inertia_zz",
            "joint2_armature",
        ]
    );
    assert_eq!(base.without_effect, [0, 4]);
}

#[test]
fn without_gravity_the_moments_of_the_first_link_have_no_effect() {
    let base = structurally_identifiable(&names(), &RANGES, |q, w, a| regressor(0.0, q, w, a));
    assert_eq!(base.without_effect, [0, 1, 2, 4]);
    assert_eq!(texts(&base)[0], "link1_inertia_zz + joint1_armature + 0.16 link2_mass");
    assert_eq!(base.independent.len(), 5);
}

#[test]
fn a_right_angle_that_a_file_has_rounded_separates_nothing() {
    // The same arm, with the axis of the second joint tilted by 2e-4 rad: a little of the second column of link 1 enters that
    // of link 2.
    let tilted = |q: &[f64], w: &[f64], a: &[f64]| {
        let mut rows = regressor(9.81, q, w, a);
        rows[6] += 2e-4 * q[1].sin() * a[1];
        rows
    };
    let base = structurally_identifiable(&names(), &RANGES, tilted);
    assert_eq!(base.independent.len(), 7);
    assert_eq!(texts(&base)[0], "link1_moment_x + 0.4 link2_mass");
}

#[test]
fn combinations_and_their_columns_give_the_torques_of_all_parameters() {
    let base = structurally_identifiable(&names(), &RANGES, |q, w, a| regressor(9.81, q, w, a));
    let parameters: Vec<f64> = (1..=11).map(|k| 0.3 * f64::from(k)).collect();
    let values = base.values(&parameters);
    let factors = base.factors();
    for row in regressor(9.81, &[0.7, -1.9], &[1.1, 0.4], &[-3.0, 5.0]).chunks(11) {
        let full: f64 = row.iter().zip(&parameters).map(|(x, p)| x * p).sum();
        let reduced: f64 = base.base_row(row).iter().zip(&values).map(|(x, p)| x * p).sum();
        assert_relative_eq!(full, reduced, epsilon = 1e-12);
    }
    for (row, value) in factors.iter().zip(&values) {
        let sum: f64 = row.iter().zip(&parameters).map(|(x, p)| x * p).sum();
        assert_relative_eq!(sum, *value, epsilon = 1e-12);
    }
}

/// Stacked rows of a motion of the first joint, with the second at rest at 0; only the first joint's torque is known.
fn log_of_first_joint(amplitude: f64) -> TriangularFactor {
    let mut factor = TriangularFactor::new(11);
    for i in 0..2000 {
        let t = f64::from(i) * 0.01;
        let (q, w, a) = (amplitude * t.sin(), amplitude * t.cos(), -amplitude * t.sin());
        factor.add_rows(&regressor(9.81, &[q, 0.0], &[w, 0.0], &[a, 0.0])[..11]);
    }
    factor
}

#[test]
fn a_log_in_which_one_joint_rests_identifies_fewer_combinations() {
    let base = base_parameters(&log_of_first_joint(1.5), &names(), &Independence::Share(ROUNDING));
    assert_eq!(
        texts(&base),
        [
            "link1_moment_x + 0.4 link2_mass + link2_moment_x",
            "link1_moment_y + link2_moment_y",
            "link1_inertia_zz + joint1_armature + 0.16 link2_mass + 0.8 link2_moment_x + link2_inertia_zz",
        ]
    );
    assert!(base.without_effect.contains(&10), "a joint at rest does not show its armature");
}

#[test]
fn a_weakly_excited_combination_is_dropped_when_noise_exceeds_its_effect() {
    // With small swings the torque of inertia, a, is proportional to that of the moment y, -g sin q, up to the third power of
    // the swing.
    let factor = log_of_first_joint(0.05);
    let exact = base_parameters(&factor, &names(), &Independence::Share(ROUNDING));
    let with_noise = |torque_sd: f64| {
        base_parameters(&factor, &names(), &Independence::Noise { torque_sd, plausible: vec![0.5; 11] })
    };
    assert_eq!(exact.independent.len(), 3);
    assert_eq!(with_noise(1e-6).independent.len(), 3);
    let weak = with_noise(0.1);
    assert_eq!(weak.independent, [1, 2]);
    // Inertia then counts as a moment y of 1/9.81 m of its value: a = (1/g) (-g q).
    let inertia = weak.dependent.iter().find(|dependent| dependent.parameter == 3).expect("dependent");
    assert_eq!(inertia.coefficients.len(), 1);
    assert_eq!(inertia.coefficients[0].0, 1);
    assert_relative_eq!(inertia.coefficients[0].1, 1.0 / 9.81, max_relative = 1e-3);
}

#[test]
fn factors_have_four_digits() {
    let texts: Vec<String> = [0.4, 1.0 / 3.0, 12345.6, 1e-5, 2.0, 100.0, 0.9999999]
        .iter()
        .map(|value| four_digits(*value))
        .collect();
    assert_eq!(texts, ["0.4", "0.3333", "12346", "1e-5", "2", "100", "1"]);
}
