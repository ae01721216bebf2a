//! Contract: the checks find mistakes of a logger in data of any system: a recording whose clock or column is
//! in another unit, and one signal in two columns. Correct data that look similar pass: other sample rates,
//! and coarse columns that agree by chance.
//!
//! The data are twelve recordings of an object that a heater warms (time constant 100 s, 0.05 K of noise, a
//! row every 2 s).

use augsim_data::checks::{AcceptedChecks, Check, ExpectedData, Finding, Severity, check_data, run_checks};
use augsim_data::{Dataset, Trajectory, random_stream};
use rand::RngExt;

const STEP_S: f64 = 2.0;

/// Recording: times, s, and three columns (heater power, temperature of the object, temperature of the heater).
type Recording = (Vec<f64>, [Vec<f64>; 3]);

/// Simulates recording `number` with `samples` rows, one every `step_s` seconds.
fn recording(number: u64, step_s: f64, samples: u32) -> Recording {
    let mut rng = random_stream(21, "heater", number);
    let powers: Vec<f64> = (0..8).map(|_| 50.0 * rng.random::<f64>()).collect();
    let (mut object, mut heater) = (300.0, 300.0);
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    let times: Vec<f64> = (0..samples).map(|k| f64::from(k) * step_s).collect();
    for t in &times {
        let power = powers[(t / 40.0) as usize % powers.len()];
        let mut noise = || 0.05 * 12f64.sqrt() * (rng.random::<f64>() - 0.5);
        columns[0].push(power);
        columns[1].push(object + noise());
        columns[2].push(heater + noise());
        // Integration steps of at most half a second, so that all sample rates have the same accuracy.
        let substeps = (step_s / 0.5).ceil();
        for _ in 0..substeps as usize {
            heater += step_s / substeps * (power - (heater - object)) / 20.0;
            object += step_s / substeps * ((heater - object) - (object - 290.0)) / 100.0;
        }
    }
    (times, columns)
}

fn recordings() -> Vec<Recording> {
    (0..12).map(|number| recording(number, STEP_S, 120)).collect()
}

fn set(recordings: Vec<Recording>) -> Dataset {
    let trajectory = |(j, (times, columns)): (usize, Recording)| {
        Trajectory::new(format!("r{j}"), times, columns.to_vec()).expect("valid")
    };
    let trajectories = recordings.into_iter().enumerate().map(trajectory).collect();
    Dataset::from_names(&["heat_W", "object_K", "heater_K"], trajectories)
        .expect("valid")
        .with_path("heater.csv")
}

/// Data set of the twelve recordings after `change` altered them.
fn changed(change: impl Fn(&mut Vec<Recording>)) -> Dataset {
    let mut recordings = recordings();
    change(&mut recordings);
    set(recordings)
}

/// Expected data of a model with the given outputs and inputs.
fn model(outputs: &[&str], inputs: &[&str]) -> ExpectedData {
    let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect();
    ExpectedData { outputs: names(outputs), inputs: names(inputs), ..ExpectedData::default() }
}

fn heater() -> ExpectedData {
    model(&["object_K", "heater_K"], &["heat_W"])
}

fn found(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    run_checks(data, expected).into_iter().flat_map(|o| o.findings).collect()
}

/// Returns the only finding of `check`, its severity, and the message of the error or warning.
fn only(data: Dataset, expected: &ExpectedData, check: Check) -> (Finding, Severity, String) {
    let mut findings = found(&data, expected);
    assert_eq!(findings.len(), 1, "{findings:?}");
    let finding = findings.remove(0);
    assert_eq!(finding.check(), check);
    let accepted = AcceptedChecks::default().with(check);
    let admitted = check_data(data.clone(), expected, accepted).expect("accepted");
    let trajectories = data.trajectories().len();
    assert_eq!((admitted.data.trajectories().len(), admitted.warnings.len()), (trajectories, 0));
    let text = match check_data(data, expected, AcceptedChecks::default()) {
        Err(refused) => refused.to_string(),
        Ok(admitted) => {
            assert_eq!(admitted.data.trajectories().len(), trajectories, "nothing is left out");
            admitted.warnings[0].text.clone()
        }
    };
    let severity = finding.severity();
    (finding, severity, text)
}

fn stretch(recordings: &mut [Recording], factor: f64) {
    recordings.iter_mut().flat_map(|(times, _)| times).for_each(|t| *t *= factor);
}

#[test]
fn correct_recordings_pass() {
    assert_eq!(found(&set(recordings()), &heater()), []);
    assert_eq!(found(&set(recordings()), &ExpectedData::default()), []);
}

#[test]
fn a_clock_in_another_unit_is_refused() {
    for (factor, unit) in [
        (1e3, "its clock is in milliseconds"),
        (1e6, "its clock is in microseconds"),
        (1e9, "its clock is in nanoseconds"),
        (1.0 / 60.0, "its clock is in minutes"),
        (1.0 / 3600.0, "its clock is in hours"),
        (1e-3, "the clocks of the others are in milliseconds"),
        (60.0, "the clocks of the others are in minutes"),
    ] {
        let data = changed(|all| stretch(&mut all[3..4], factor));
        let (_, severity, text) = only(data, &heater(), Check::MixedClock);
        assert_eq!(severity, Severity::Refused);
        for part in ["heater.csv: suspicious data (mixed-clock)", "trajectory `r3`", unit, "to seconds"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
    let (finding, _, text) =
        only(changed(|all| stretch(&mut all[3..4], 1e3)), &ExpectedData::default(), Check::MixedClock);
    assert!(
        text.contains("2000 s, but that of the other 11 trajectories is 2 s, a ratio of about 1000"),
        "{text}"
    );
    assert!(matches!(finding, Finding::MixedClock { others: 11, alike: 1, .. }));
}

#[test]
fn of_several_wrong_clocks_the_first_is_named_and_all_are_counted() {
    let (finding, _, text) = only(changed(|all| stretch(&mut all[5..8], 1e3)), &heater(), Check::MixedClock);
    assert!(matches!(finding, Finding::MixedClock { others: 9, alike: 3, .. }));
    assert!(text.contains("trajectory `r5`") && text.contains("3 trajectories are like this"), "{text}");
    // Half of the recordings are not exceptions, and two others are too few.
    assert_eq!(found(&changed(|all| stretch(&mut all[..6], 1e3)), &heater()), []);
    let three = changed(|all| {
        all.truncate(3);
        stretch(&mut all[..1], 1e3);
    });
    assert_eq!(found(&three, &heater()), []);
}

#[test]
fn a_clock_in_milliseconds_is_found_among_several_sample_rates() {
    let data = changed(|all| {
        all[1] = recording(1, 2.0 * STEP_S, 60);
        all[2] = recording(2, 0.5 * STEP_S, 240);
        stretch(&mut all[4..5], 1e3);
    });
    let (_, _, text) = only(data, &heater(), Check::MixedClock);
    assert!(text.contains("trajectory `r4`"), "{text}");
}

#[test]
fn other_sample_rates_pass() {
    for (step_s, samples) in [
        // Twice as fast or slow.
        (0.5 * STEP_S, 240),
        (2.0 * STEP_S, 60),
        // By the ratio of two units: over the same time, and with the same number of samples, as with an
        // oscilloscope.
        (STEP_S / 60.0, 7200),
        (STEP_S / 60.0, 120),
        (STEP_S / 1000.0, 120),
        (60.0 * STEP_S, 120),
        (1000.0 * STEP_S, 120),
    ] {
        let data = changed(|all| all[3] = recording(3, step_s, samples));
        assert_eq!(found(&data, &heater()), [], "{step_s} s, {samples} samples");
    }
    // Sample rates that were chosen individually.
    let data = changed(|all| {
        stretch(&mut all[3..4], 1e3);
        stretch(&mut all[4..5], 30.0);
    });
    assert_eq!(found(&data, &heater()), []);
}

#[test]
fn columns_of_noise_give_no_finding_about_the_clock() {
    let data = changed(|all| {
        for (j, (_, columns)) in all.iter_mut().enumerate() {
            let mut rng = random_stream(22, "noise", j as u64);
            columns[0].fill(5.0);
            columns[1..].iter_mut().flatten().for_each(|v| *v = 300.0 + rng.random::<f64>());
        }
        stretch(&mut all[3..4], 1e3);
    });
    assert_eq!(found(&data, &heater()), []);
}

#[test]
fn two_outputs_with_one_signal_are_refused() {
    let twice = || changed(|all| all.iter_mut().for_each(|(_, c)| c[2] = c[1].clone()));
    let (_, severity, text) = only(twice(), &heater(), Check::DuplicateColumn);
    assert_eq!(severity, Severity::Refused);
    for part in [
        "heater.csv: suspicious data (duplicate-column)",
        "columns `object_K` and `heater_K`, both outputs",
        "all 1440 samples",
        "remove it from the model",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // Gaps in one of them do not hide it.
    let gaps = changed(|all| {
        all.iter_mut().for_each(|(_, c)| {
            c[2] = c[1].clone();
            c[1].iter_mut().step_by(3).for_each(|v| *v = f64::NAN);
        })
    });
    assert_eq!(only(gaps, &heater(), Check::DuplicateColumn).1, Severity::Refused);
    // A column that the model does not read does not matter.
    assert_eq!(found(&twice(), &model(&["object_K"], &["heat_W"])), []);
}

#[test]
fn a_difference_in_one_value_makes_two_signals() {
    let data = changed(|all| {
        all.iter_mut().for_each(|(_, c)| c[2] = c[1].clone());
        all[11].1[2][119] += 1e-3;
    });
    assert_eq!(found(&data, &heater()), []);
}

#[test]
fn a_repeated_input_or_one_equal_to_an_output_is_a_warning() {
    let twice = || changed(|all| all.iter_mut().for_each(|(_, c)| c[2] = c[1].clone()));
    for (expected, part) in [
        (
            model(&["object_K"], &["heater_K", "heat_W"]),
            "column `heater_K`, an input of the model, holds the same",
        ),
        (
            model(&["heater_K"], &["object_K", "heat_W"]),
            "column `object_K`, an input of the model, holds the same",
        ),
        (model(&[], &["object_K", "heater_K"]), "both inputs of the model"),
        (ExpectedData::default(), "columns `object_K` and `heater_K` hold the same numbers"),
    ] {
        let (_, severity, text) = only(twice(), &expected, Check::DuplicateColumn);
        assert_eq!(severity, Severity::Warning);
        assert!(text.starts_with("heater.csv: ") && text.contains(part), "{text}");
    }
}

#[test]
fn coarse_columns_that_agree_pass() {
    // Two sensors of one temperature with an offset of 1 mK and a resolution of 1 K agree at all 120 samples.
    let times: Vec<f64> = (0..120).map(|k| f64::from(k) * STEP_S).collect();
    let read = |offset: f64| times.iter().map(|t| (20.3 + 6.0 * (0.02 * t).sin() + offset).round()).collect();
    let columns: [Vec<f64>; 3] = [times.iter().map(|t| t.sin()).collect(), read(0.0), read(1e-3)];
    assert_eq!(columns[1], columns[2], "the columns of the test agree");
    assert_eq!(found(&set(vec![(times.clone(), columns)]), &heater()), []);
    // Two switches that are always switched together.
    let switches = changed(|all| {
        for (_, c) in all.iter_mut() {
            let on = c[0].iter().map(|p| f64::from(u8::from(*p > 25.0))).collect::<Vec<_>>();
            (c[1], c[2]) = (on.clone(), on);
        }
    });
    assert_eq!(found(&switches, &heater()), []);
    assert_eq!(found(&switches, &model(&[], &["object_K", "heater_K"])), []);
}

#[test]
fn coarse_columns_that_agree_long_enough_are_one_signal() {
    let rounded = |unit: f64| {
        changed(move |all| {
            for (_, c) in all.iter_mut() {
                c[1].iter_mut().for_each(|v| *v = (*v / unit).round() * unit);
                c[2] = c[1].clone();
            }
        })
    };
    // The object warms by about 20 K, which is 2000 and 200 steps; 1440 noisy samples agree.
    for unit in [0.01, 0.1] {
        assert_eq!(only(rounded(unit), &heater(), Check::DuplicateColumn).1, Severity::Refused, "{unit} K");
    }
}

#[test]
fn columns_that_are_constant_in_each_recording_may_be_equal() {
    let data = changed(|all| {
        for (j, (_, c)) in all.iter_mut().enumerate() {
            (c[1], c[2]) = (vec![300.0 + (j as f64).sqrt(); 120], vec![300.0 + (j as f64).sqrt(); 120]);
        }
    });
    assert_eq!(found(&data, &heater()), []);
}

#[test]
fn a_column_of_one_recording_that_is_scaled_by_1000_is_refused() {
    for column in 0..3 {
        let data = changed(|all| all[3].1[column].iter_mut().for_each(|v| *v *= 1e3));
        let (_, severity, text) = only(data, &heater(), Check::MixedUnits);
        assert_eq!(severity, Severity::Refused);
        assert!(text.contains("trajectory `r3`"), "{text}");
    }
}
