//! Contract: `fit`, `predict`, `evaluate` and `data inspect` read time and units alike, say what they took, and
//! refuse columns without values, wrapped angles and degrees Celsius in kelvins, with the remedy.

use crate::command::{augsim, fail, succeed};
use std::fmt::Write;
use std::path::Path;

const DECAY: &str = "scenario = \"system\"\nname = \"decay\"\n[states]\nx_m = { start = \"pos_m\" }\n[parameters]\n\
                     tau_s = { nominal = 2.0, min = 0.1, max = 100000.0 }\n[rates]\nx_m = \"-x_m / tau_s\"\n[outputs]\n\
                     pos_m = { value = \"x_m\", sd = 0.001 }\n";

/// CSV text of an exponential decay, sampled every 0.1 with a time constant of 4, in the unit of the clock.
fn decay(header: &str, times: impl Fn(f64) -> String) -> String {
    let mut text = format!("{header}\n");
    for k in 0..80 {
        let t = 0.1 * f64::from(k);
        let _ = writeln!(text, "{},{:.7}", times(t), (-t / 4.0).exp());
    }
    text
}

fn write(dir: &Path, name: &str, text: &str) {
    std::fs::write(dir.join(name), text).expect("written");
}

fn tau(dir: &Path, args: &[&str]) -> f64 {
    let out = succeed(&[&["fit", "decay.toml"], args, &["--json", "--force"]].concat(), dir);
    let answer: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    answer["parameters"][0]["value"].as_f64().expect("a number")
}

#[test]
fn a_fit_has_the_time_constant_in_seconds_for_every_clock() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let check = |args: &[&str], expected: f64| {
        // The fit begins at half the value, whatever the unit of the clock.
        let nominal = format!("nominal = {:?}", 0.5 * expected);
        write(d, "decay.toml", &DECAY.replace("nominal = 2.0", &nominal));
        let found = tau(d, args);
        assert!((found / expected - 1.0).abs() < 1e-3, "{args:?}: {found}");
    };
    for (header, expected) in [("time (hours),pos_m", 14_400.0), ("t_min,pos_m", 240.0), ("t_s,pos_m", 4.0)] {
        write(d, "run.csv", &decay(header, |t| t.to_string()));
        check(&["run.csv"], expected);
    }
    write(d, "run.csv", &decay("time,pos_m", |t| format!("{:.0}", 1000.0 * t)));
    check(&["run.csv", "--time", "time:s"], 4000.0);
    check(&["run.csv"], 4.0);
    for args in [
        &["fit", "decay.toml", "run.csv", "--force"][..],
        &["evaluate", "decay.toml", "--data", "run.csv"],
        &["predict", "decay.toml", "--data", "run.csv"],
        &["data", "inspect", "run.csv", "--model", "decay.toml"],
    ] {
        let out = augsim(args, d);
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(error.contains("steps of 100 are read as milliseconds"), "{args:?}: {error}");
    }
}

#[test]
fn a_trajectory_without_values_is_an_error_that_names_it() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    write(d, "decay.toml", DECAY);
    let mut text = "trajectory,t_s,pos_m\n".to_owned();
    for id in ["a", "b"] {
        for k in 0..40 {
            let t = 0.1 * f64::from(k);
            let cell = if id == "a" { format!("{:.6}", (-t / 4.0).exp()) } else { String::new() };
            let _ = writeln!(text, "{id},{t},{cell}");
        }
    }
    write(d, "run.csv", &text);
    let texts = ["run.csv, trajectory `b`: column `pos_m`, an output of decay.toml, has no value"];
    for args in [
        &["fit", "decay.toml", "run.csv"][..],
        &["discover", "decay.toml", "run.csv"],
        &["predict", "decay.toml", "--data", "run.csv"],
        &["evaluate", "decay.toml", "--data", "run.csv"],
        &["train", "--model", "decay.toml", "--data", "run.csv"],
        &["data", "inspect", "run.csv", "--model", "decay.toml"],
    ] {
        fail(3, args, d, &texts);
    }
    let driven = DECAY
        .replace("[states]", "[inputs]\nforce_N = {}\n[states]")
        .replace("-x_m / tau_s", "-x_m / tau_s + force_N * k_m_per_N_s")
        .replace("[rates]", "k_m_per_N_s = 1.0\n[rates]");
    write(d, "driven.toml", &driven);
    write(d, "driven.csv", "t_s,force_N,pos_m\n0,,1\n0.1,,0.9\n0.2,,0.8\n0.3,,0.7\n");
    fail(
        3,
        &["fit", "driven.toml", "driven.csv", "--force"],
        d,
        &["column `force_N`, an input of driven.toml, has no value"],
    );
}

#[test]
fn a_wrapped_angle_and_degrees_celsius_are_refused_with_the_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let turning = "scenario = \"system\"\nname = \"rotor\"\n[states]\ntheta_rad = { start = \"angle_rad\" }\n[parameters]\n\
                   speed_rad_s = { nominal = 1.0, min = 0.0, max = 10.0 }\n[rates]\ntheta_rad = \"speed_rad_s\"\n[outputs]\n\
                   angle_rad = { value = \"theta_rad\", sd = 0.01 }\n";
    write(d, "rotor.toml", turning);
    let mut text = "t_s,angle_rad\n".to_owned();
    for k in 0..200 {
        let angle = 0.1 * f64::from(k);
        let _ = writeln!(
            text,
            "{},{}",
            0.05 * f64::from(k),
            (angle + 3.0).rem_euclid(std::f64::consts::TAU) - 3.1
        );
    }
    write(d, "wrap.csv", &text);
    fail(
        3,
        &["fit", "rotor.toml", "wrap.csv", "--force"],
        d,
        &["jumps by a full turn", "period_rad = ", "--accept angle-wrap"],
    );
    assert!(succeed(&["data", "inspect", "wrap.csv"], d).contains("jumps by a full turn"));
    write(d, "period.toml", &turning.replace("sd = 0.01", "sd = 0.01, period_rad = 6.283185307179586"));
    succeed(&["fit", "period.toml", "wrap.csv", "--force"], d);

    let cooling = "scenario = \"system\"\nname = \"cup\"\n[states]\nT_K = { start = \"temp_K\" }\n[parameters]\n\
                   room_K = { nominal = 295.0, min = 250.0, max = 350.0 }\ntau_s = { nominal = 5.0, min = 0.1, max = 100.0 }\n\
                   [rates]\nT_K = \"(room_K - T_K) / tau_s\"\n[outputs]\ntemp_K = { value = \"T_K\", sd = 0.01 }\n";
    write(d, "cup.toml", cooling);
    let rows = |header: &str| {
        let mut text = format!("{header}\n");
        for k in 0..80 {
            let t = 0.1 * f64::from(k);
            let _ = writeln!(text, "{t},{:.5}", 20.0 + 30.0 * (-t / 3.0).exp());
        }
        text
    };
    write(d, "kelvin.csv", &rows("t_s,temp_K"));
    fail(
        3,
        &["fit", "cup.toml", "kelvin.csv", "--force"],
        d,
        &["degrees Celsius", "temp_degC", "--accept celsius-in-kelvin"],
    );
    write(d, "celsius.csv", &rows("t_s,temp_degC"));
    let out = succeed(&["fit", "cup.toml", "celsius.csv", "--json", "--force"], d);
    let answer: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    let room = answer["parameters"][0]["value"].as_f64().expect("a number");
    assert!((room - 293.15).abs() < 0.05, "{room}");
}

#[test]
fn a_fit_that_is_worse_than_the_mean_ends_with_the_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    // A time constant of 4 h, of which the model allows no more than 100 s.
    write(
        d,
        "narrow.toml",
        &DECAY.replace("max = 100000.0", "max = 100.0").replace("nominal = 2.0", "nominal = 3.0"),
    );
    let mut noisy = "t_h,pos_m\n".to_owned();
    for k in 0..80 {
        let t = 0.1 * f64::from(k);
        let _ = writeln!(noisy, "{t},{:.5}", 100.0 * (-t / 4.0).exp() + [0.5, -0.4, 0.1][k as usize % 3]);
    }
    write(d, "hours.csv", &noisy);
    let out = augsim(&["fit", "narrow.toml", "hours.csv"], d);
    let text = String::from_utf8_lossy(&out.stdout);
    assert_eq!(out.status.code(), Some(1), "{text}");
    for part in [
        "Not this system: the calibrated model predicts `pos_m` worse than its mean does",
        "--time COLUMN:UNIT",
        "bounds of the parameters",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let result = std::fs::read_to_string(d.join("out/fit/result.json")).expect("a result");
    assert!(result.contains("\"rejection\": \"Not this system"), "{result}");
    // Without noise the fit makes the model faster and faster instead.
    write(d, "exact.csv", &decay("t_h,pos_m", |t| t.to_string()));
    write(d, "narrow.toml", &DECAY.replace("max = 100000.0", "max = 100.0"));
    let texts = ["ever faster than the data", "--time COLUMN:UNIT", "bounds of the parameters"];
    fail(3, &["fit", "narrow.toml", "exact.csv", "--out", "exact"], d, &texts);
}

#[test]
fn degrees_in_a_column_of_radians_are_found_by_the_model() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    succeed(&["model", "new", "pendulum"], d);
    let start = ["simulate", "pendulum.toml", "--duration-s", "4", "--start", "theta_rad=0.6"];
    succeed(&[&start[..], &["--out", "swing.csv"]].concat(), d);
    let text = std::fs::read_to_string(d.join("swing.csv")).expect("a swing");
    let mut degrees = "trajectory,t_s,angle_rad\n".to_owned();
    for row in text.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let angle: f64 = cells[2].parse().expect("a number");
        let _ = writeln!(degrees, "{},{},{:.3}", cells[0], cells[1], angle.to_degrees());
    }
    write(d, "degrees.csv", &degrees);
    let texts = ["angle-in-degrees", "`angle_rad` reaches 34", "call the column `angle_deg`"];
    fail(3, &["fit", "pendulum.toml", "degrees.csv"], d, &texts);
    fail(3, &["discover", "pendulum.toml", "degrees.csv"], d, &texts);
    let inspected = succeed(&["data", "inspect", "degrees.csv", "--model", "pendulum.toml"], d);
    assert!(inspected.contains("call the column `angle_deg`"), "{inspected}");
    write(d, "named.csv", &degrees.replace("angle_rad", "angle_deg"));
    succeed(&["fit", "pendulum.toml", "named.csv"], d);
}

#[test]
fn a_model_in_other_units_than_si_is_refused_with_the_name_to_write() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    write(d, "decay.csv", &decay("t_s,pos_m", |t| t.to_string()));
    for (from, to, text) in [
        ("pos_m = {", "pos_mm = {", "the name ends in mm: call it `pos_m`"),
        ("tau_s = {", "tau_ms = {", "the name ends in ms: call it `tau_s`"),
        ("value = \"x_m\"", "value = \"x_m\", unit = \"mm\"", "\"mm\" is none: write unit = \"m\""),
    ] {
        write(d, "decay.toml", &DECAY.replace(from, to));
        fail(3, &["fit", "decay.toml", "decay.csv", "--force"], d, &[text]);
    }
}
