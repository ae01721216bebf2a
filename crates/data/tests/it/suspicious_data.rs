//! Contract: each check finds its mistake in a data set that the readers accept, and correct data pass all
//! checks.
//!
//! The data are twelve thrown balls (2 mm of noise, 100 Hz, gravity 9.81 m/s², one or two bounces) with the
//! mistakes that users have made, and pushes of a square for the mistakes that only pushes reveal.

use augsim_data::checks::{AcceptedChecks, Check, ExpectedData, Finding, Severity, check_data, run_checks};
use augsim_data::{Dataset, Trajectory, random_stream};
use rand::RngExt;

const NOISE_M: f64 = 2e-3;
const BALL: ExpectedData = ExpectedData {
    gravity_m_s2: Some(9.81),
    position_sd_m: Some(NOISE_M),
    angle_sd_rad: None,
    outputs: Vec::new(),
    inputs: Vec::new(),
    periodic: Vec::new(),
    temperatures_kelvin: Vec::new(),
};
const PUSH: ExpectedData = ExpectedData {
    gravity_m_s2: None,
    position_sd_m: Some(3e-4),
    angle_sd_rad: Some(2e-3),
    outputs: Vec::new(),
    inputs: Vec::new(),
    periodic: Vec::new(),
    temperatures_kelvin: Vec::new(),
};

/// Times, s, and columns of a trajectory.
type Rows = (Vec<f64>, Vec<Vec<f64>>);

/// Uniform noise of standard deviation `sd`.
fn noise(rng: &mut impl RngExt, sd: f64) -> f64 {
    sd * 12f64.sqrt() * (rng.random::<f64>() - 0.5)
}

/// Throws that bounce with restitution 0.7: columns x, z and vertical velocity of each.
fn throws() -> Vec<Rows> {
    (0..12)
        .map(|j| {
            let mut rng = random_stream(7, "throws", j);
            let (mut z, mut v) = (1.5 + 0.5 * rng.random::<f64>(), rng.random::<f64>());
            let speed = 0.5 + rng.random::<f64>();
            let times: Vec<f64> = (0..90).map(|k| f64::from(k) / 100.0).collect();
            let (mut xs, mut zs, mut vs) = (Vec::new(), Vec::new(), Vec::new());
            for t in &times {
                xs.push(speed * t + noise(&mut rng, NOISE_M));
                zs.push(z + noise(&mut rng, NOISE_M));
                vs.push(v);
                (z, v) = (z + 0.01 * v - 0.5 * 9.81 * 1e-4, v - 0.0981);
                if z < 0.0 {
                    (z, v) = (-0.7 * z, -0.7 * v);
                }
            }
            (times, vec![xs, zs, vs])
        })
        .collect()
}

fn set(names: &[&str], all: Vec<Rows>) -> Dataset {
    let one =
        |(j, (times, values)): (usize, Rows)| Trajectory::new(j.to_string(), times, values).expect("valid");
    let trajectories = all.into_iter().enumerate().map(one).collect();
    Dataset::from_names(names, trajectories).expect("valid").with_path("throws.csv")
}

/// Data set of the throws after `change` altered them.
fn changed(change: impl FnOnce(&mut Vec<Rows>)) -> Dataset {
    let mut all = throws();
    change(&mut all);
    set(&["x_m", "z_m", "velocity_m_s"], all)
}

/// Data set of the altered throws without the velocity, by which other checks would find some mistakes first.
fn positions(change: impl FnOnce(&mut Vec<Rows>)) -> Dataset {
    let mut all = throws();
    all.iter_mut().for_each(|(_, columns)| columns.truncate(2));
    change(&mut all);
    set(&["x_m", "z_m"], all)
}

/// Data set of pushes over 0.2 m that rotate a square, sampled every 10 ms, after `change` altered them.
fn pushes(change: impl FnOnce(&mut Vec<Rows>)) -> Dataset {
    let one = |j: u64| {
        let mut rng = random_stream(8, "pushes", j);
        let turn = 2.0 * rng.random::<f64>() - 1.0;
        let times: Vec<f64> = (0..200).map(|k| f64::from(k) / 100.0).collect();
        let mut columns = vec![Vec::new(); 5];
        for t in &times {
            let rod = 0.1 * t;
            columns[0].push(rod);
            columns[1].push(0.0);
            columns[2].push(rod + 0.05 + noise(&mut rng, 3e-4));
            columns[3].push(0.005 * turn * t + noise(&mut rng, 3e-4));
            columns[4].push(turn * t + noise(&mut rng, 2e-3));
        }
        (times, columns)
    };
    let mut all: Vec<Rows> = (0..12).map(one).collect();
    change(&mut all);
    set(&["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"], all)
}

/// Multiplies the columns `which` of the trajectories by `factor`.
fn scale(all: &mut [Rows], which: &[usize], factor: f64) {
    for (_, columns) in all {
        which.iter().for_each(|&c| columns[c].iter_mut().for_each(|v| *v *= factor));
    }
}

fn found(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    run_checks(data, expected).into_iter().flat_map(|o| o.findings).collect()
}

/// Message of the first finding, which must come from `check` and refuse the data.
fn refusal(data: Dataset, expected: &ExpectedData, check: Check) -> String {
    let first = found(&data, expected).into_iter().next().expect("something is found");
    assert_eq!((first.check(), first.severity()), (check, Severity::Refused), "{first}");
    let accepted = Check::all().collect::<AcceptedChecks>();
    assert!(
        check_data(data.clone(), expected, accepted).is_ok(),
        "no finding remains where all checks are accepted"
    );
    let text = check_data(data, expected, AcceptedChecks::default()).expect_err("refused").to_string();
    assert!(text.starts_with("throws.csv: suspicious data") && text.contains(check.name()), "{text}");
    text
}

#[test]
fn correct_data_pass_every_check() {
    assert_eq!(found(&changed(|_| ()), &BALL), []);
    assert_eq!(found(&positions(|_| ()), &BALL), []);
    assert_eq!(found(&pushes(|_| ()), &PUSH), []);
}

#[test]
fn a_repeated_trajectory_is_left_out_with_a_warning() {
    for digits in [17, 4] {
        let data = positions(|all| {
            let round = |v: &f64| format!("{v:.digits$}").parse().expect("a number");
            let (times, columns) = all[3].clone();
            all.push((times, columns.iter().map(|c| c.iter().map(round).collect()).collect()));
        });
        let admitted = check_data(data.clone(), &BALL, AcceptedChecks::default()).expect("a warning only");
        assert_eq!(admitted.data.trajectories().len(), 12, "one of the two is kept");
        assert!(admitted.data.trajectories().iter().any(|t| t.id() == "3"));
        let text = &admitted.warnings[0].text;
        assert!(text.contains("throws.csv: trajectory `12` repeats `3`"), "{text}");
        let kept = check_data(data, &BALL, AcceptedChecks::default().with(Check::RepeatedTrajectory))
            .expect("accepted");
        assert_eq!((kept.data.trajectories().len(), kept.warnings.len()), (13, 0));
    }
}

#[test]
fn repeated_measurements_in_whole_millimetres_are_not_copies() {
    // Eight drops with 0.1 mm of noise and nine samples each, so two of them may agree in every digit.
    let drop = |j: u64| {
        let mut rng = random_stream(9, "gate", j);
        let times: Vec<f64> = (0..9).map(|k| f64::from(k) / 30.0).collect();
        let height = |t: &f64| (1e3 * (0.5 - 4.905 * t * t + noise(&mut rng, 1e-4))).round() / 1e3;
        let heights = times.iter().map(height).collect();
        (times, vec![heights])
    };
    let data = set(&["height_m"], (0..8).map(drop).collect());
    assert_eq!(found(&data, &ExpectedData::default()), []);
}

#[test]
fn a_coordinate_in_centimetres_is_refused() {
    let text = refusal(positions(|all| scale(all, &[0], 100.0)), &BALL, Check::ColumnScale);
    assert!(text.contains("column `x_m`") && text.contains("convert it to metres"), "{text}");
    refusal(positions(|all| scale(all, &[1], 100.0)), &BALL, Check::ColumnScale);
    refusal(pushes(|all| scale(all, &[2], 100.0)), &PUSH, Check::ColumnScale);
}

#[test]
fn one_trajectory_in_another_unit_is_refused() {
    for factor in [100.0, 1000.0] {
        let text = refusal(positions(|all| scale(&mut all[4..5], &[0, 1], factor)), &BALL, Check::MixedUnits);
        assert!(text.contains("trajectory `4`"), "{text}");
    }
    // Upside down no span is too wide, but the acceleration has the wrong sign.
    let upside = refusal(positions(|all| scale(&mut all[4..5], &[1], -1.0)), &BALL, Check::GravityDisagrees);
    assert!(upside.contains("trajectory `4`") && upside.contains("change the sign"), "{upside}");
}

#[test]
fn one_trajectory_that_only_goes_far_passes() {
    // Like an angle that makes full turns while others swing: its curvature and noise are those of the
    // others.
    let wind =
        |all: &mut Vec<Rows>| all[4].1[0].iter_mut().enumerate().for_each(|(k, x)| *x += 0.5 * k as f64);
    assert_eq!(found(&positions(wind), &ExpectedData::default()), []);
    assert_ne!(found(&positions(|all| scale(&mut all[4..5], &[0], 100.0)), &ExpectedData::default()), []);
    // An accelerated motion has a larger curvature than the others, but an even larger span.
    let faster = |all: &mut Vec<Rows>| {
        all[4].1[0].iter_mut().enumerate().for_each(|(k, x)| *x += 2.0 * k as f64 + 2e-2 * (k * k) as f64);
    };
    assert_eq!(found(&positions(faster), &ExpectedData::default()), []);
    // It does not hide a trajectory that is in another unit.
    let both = positions(|all| {
        wind(all);
        scale(&mut all[7..8], &[0], 100.0);
    });
    let findings = found(&both, &ExpectedData::default());
    let [Finding::MixedUnits { trajectory, alike, .. }] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!((trajectory.as_str(), *alike), ("7", 1));
}

#[test]
fn sentinel_values_are_refused_as_outliers() {
    let data = positions(|all| all.iter_mut().for_each(|(_, columns)| columns[1][17] = 9999.0));
    let text = refusal(data, &BALL, Check::SentinelValue);
    for part in [
        "trajectory `0`, t_s = 0.17 s: column `z_m` holds 9999",
        "12 sample(s)",
        "outlier",
        "leave cells empty",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    refusal(positions(|all| all[2].1[0][5] = -999.0), &BALL, Check::SentinelValue);
}

#[test]
fn a_column_shifted_by_a_row_is_refused() {
    // Like a shift in a spreadsheet: over the whole file, from one trajectory into the next.
    for down in [true, false] {
        let data = positions(|all| {
            let mut column: Vec<f64> = all.iter().flat_map(|(_, c)| c[1].clone()).collect();
            if down {
                column.rotate_right(1)
            } else {
                column.rotate_left(1)
            }
            for ((_, columns), shifted) in all.iter_mut().zip(column.chunks(90)) {
                columns[1] = shifted.to_vec();
            }
        });
        let text = refusal(data, &BALL, Check::ShiftedColumn);
        assert!(text.contains("column `z_m`") && text.contains("shifted by a row"), "{text}");
    }
    // A shift within trajectories is found only with a velocity.
    let data = changed(|all| {
        for (times, columns) in all.iter_mut() {
            // Noise of 2 mm at 100 Hz is 0.3 m/s, so the heights here are integrated from the velocity.
            let mut height = vec![1.0];
            for k in 0..times.len() - 1 {
                height.push(height[k] + 0.01 * columns[2][k]);
            }
            columns[1] = height;
            columns[2].rotate_right(2);
        }
    });
    refusal(data, &ExpectedData::default(), Check::ShiftedColumn);
}

#[test]
fn an_angle_in_degrees_is_refused() {
    let text =
        refusal(pushes(|all| scale(all, &[4], 180.0 / std::f64::consts::PI)), &PUSH, Check::AngleInDegrees);
    assert!(text.contains("column `theta_rad`") && text.contains("convert them to radians"), "{text}");
}

#[test]
fn a_constant_angle_height_or_velocity_is_refused() {
    let constant =
        |all: &mut Vec<Rows>, c: usize| all.iter_mut().for_each(|(_, columns)| columns[c].fill(0.3));
    let text = refusal(pushes(|all| constant(all, 4)), &PUSH, Check::ConstantColumn);
    assert!(text.contains("the column `theta_rad` never changes: it holds 0.3"), "{text}");
    refusal(changed(|all| constant(all, 1)), &BALL, Check::ConstantColumn);
    refusal(changed(|all| constant(all, 2)), &BALL, Check::ConstantColumn);
}

#[test]
fn values_too_large_for_a_measurement_are_refused() {
    let text =
        refusal(changed(|all| scale(all, &[1, 2], 1e30)), &ExpectedData::default(), Check::AbsurdValue);
    assert!(text.contains("trajectory `0`, t_s = 0 s: column `z_m`"), "{text}");
}

#[test]
fn swapped_height_and_velocity_or_two_units_are_refused() {
    let swap = |all: &mut Vec<Rows>| all.iter_mut().for_each(|(_, columns)| columns.swap(1, 2));
    refusal(changed(swap), &ExpectedData::default(), Check::VelocityDisagrees);
    refusal(changed(|all| scale(all, &[2], 1000.0)), &ExpectedData::default(), Check::VelocityDisagrees);
    refusal(changed(|all| scale(all, &[2], -1.0)), &ExpectedData::default(), Check::VelocityDisagrees);
}

#[test]
fn free_fall_that_differs_from_the_models_gravity_is_refused() {
    let text = refusal(changed(|all| scale(all, &[0, 1, 2], 1000.0)), &BALL, Check::GravityDisagrees);
    assert!(text.contains("the values are in mm"), "{text}");
    let text = refusal(changed(|all| scale(all, &[1, 2], -1.0)), &BALL, Check::GravityDisagrees);
    assert!(text.contains("up must be positive"), "{text}");
    let swap = |all: &mut Vec<Rows>| all.iter_mut().for_each(|(_, columns)| columns.swap(0, 1));
    let text = refusal(positions(swap), &BALL, Check::GravityDisagrees);
    assert!(text.contains("`z_m` shows no free fall, but `x_m` falls") && text.contains("swapped"), "{text}");
    // Without a model there is no expected gravity.
    assert_eq!(found(&changed(|all| scale(all, &[0, 1, 2], 1000.0)), &ExpectedData::default()), []);
}

#[test]
fn a_declared_noise_in_the_wrong_unit_is_refused_and_a_coarse_one_is_a_warning() {
    let declared = |sd| ExpectedData { position_sd_m: Some(sd), ..BALL };
    let text = refusal(positions(|_| ()), &declared(2.043), Check::DeclaredNoise);
    assert!(text.contains("`position_sd_m` = 2.043 m") && text.contains("declare it in m"), "{text}");
    let admitted =
        check_data(positions(|_| ()), &declared(0.06), AcceptedChecks::default()).expect("a tolerance");
    assert_eq!(admitted.warnings.iter().map(|w| w.check).collect::<Vec<_>>(), [Check::DeclaredNoise]);
}

#[test]
fn every_check_is_found_by_its_name() {
    let all: Vec<Check> = Check::all().collect();
    assert!(all.iter().all(|check| Check::named(check.name()) == Some(*check)));
    assert_eq!(Check::named("nothing"), None);
}
