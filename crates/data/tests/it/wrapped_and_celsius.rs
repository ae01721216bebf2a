//! Contract: wrapped angles and degrees Celsius in kelvins are found, and set points, fast rotations, differences of
//! temperatures and cold experiments are not.

use augsim_data::checks::{ExpectedData, Finding, run_checks};
use augsim_data::{Dataset, Trajectory};
use std::f64::consts::{PI, TAU};

fn findings(column: &str, values: Vec<f64>, expected: &ExpectedData) -> Vec<Finding> {
    let times = (0..values.len()).map(|k| 0.01 * k as f64).collect();
    let run = Trajectory::new("r1", times, vec![values]).expect("a trajectory");
    let data = Dataset::from_names(&[column], vec![run]).expect("a data set");
    let is_wanted = |f: &Finding| matches!(f, Finding::AngleWrap { .. } | Finding::CelsiusInKelvin { .. });
    run_checks(&data, expected).into_iter().flat_map(|o| o.findings).filter(is_wanted).collect()
}

fn angles(value: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..400).map(|k| value(f64::from(k))).collect()
}

#[test]
fn an_angle_that_jumps_by_a_full_turn_is_found() {
    let none = ExpectedData::default();
    for (what, values) in [
        ("to -pi", angles(|k| (0.1 * k + PI).rem_euclid(TAU) - PI)),
        ("to 0", angles(|k| (0.1 * k).rem_euclid(TAU))),
        ("back and forth", angles(|k| (4.0 * (0.03 * k).sin() + PI).rem_euclid(TAU) - PI)),
        ("coarse and noisy", angles(|k| (0.7 * k + 0.1 * (7.7 * k).sin()).rem_euclid(TAU))),
    ] {
        let found = findings("angle_rad", values.clone(), &none);
        assert_eq!(found.len(), 1, "{what}: {found:?}");
        let periodic = ExpectedData {
            outputs: vec!["angle_rad".into()],
            periodic: vec!["angle_rad".into()],
            ..ExpectedData::default()
        };
        assert_eq!(findings("angle_rad", values, &periodic), [], "{what}");
    }
    for (what, values) in [
        ("not wrapped", angles(|k| 0.1 * k)),
        ("a set point", angles(|k| if (k / 50.0) as i32 % 2 == 0 { PI } else { -PI })),
        ("a swing", angles(|k| 3.0 * (0.1 * k).sin())),
        ("a fast rotation", angles(|k| 4.0 * k)),
        ("a fast swing", angles(|k| 3.0 * (2.1 * k).sin())),
        ("jumps of other sizes", angles(|k| if (k / 50.0) as i32 % 2 == 0 { 2.0 + 1e-3 * k } else { -2.0 })),
    ] {
        assert_eq!(findings("angle_rad", values, &none), [], "{what}");
    }
}

#[test]
fn degrees_celsius_in_kelvins_are_found() {
    let of = |temperatures: &[f64]| ExpectedData {
        outputs: vec!["room_K".into()],
        temperatures_kelvin: temperatures.to_vec(),
        ..ExpectedData::default()
    };
    let about = |level: f64| angles(|k| level + 0.01 * k);
    for (level, declared, is_found) in [
        (20.0, &[295.0][..], true),
        (20.0, &[295.0, 10.0], true),
        (-10.0, &[], true),
        // A difference of temperatures that decays to 0, with noise.
        (-0.1, &[], false),
        (293.0, &[295.0], false),
        (4.0, &[4.2], false),
        (77.0, &[], false),
        // Half of 273.15 K above the middle between the two readings, and half below.
        (295.0 - 130.0, &[295.0], false),
        (295.0 - 145.0, &[295.0], true),
    ] {
        let found = findings("room_K", about(level), &of(declared));
        assert_eq!(!found.is_empty(), is_found, "{level} {declared:?}: {found:?}");
    }
    assert_eq!(findings("temperature_rise_K", about(3.0), &of(&[295.0])), []);
}
