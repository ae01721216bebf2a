//! Contract: records that leave nothing to score or to test are one error that says so, never a number; a
//! note names those that are left out. Sensors that are read in alternate rows are searched like others. The
//! number of draws has an upper bound.

use crate::command::{augsim, fail, succeed, succeed_json};
use std::path::Path;

const DECAY: &str = "scenario = \"system\"\nname = \"decay\"\n[states]\nx_m = { start = \"pos_m\" }\n\
    [parameters]\nk_per_s = { nominal = 1.0, min = 0.0, max = 10.0 }\n[rates]\nx_m = \"-k_per_s * x_m\"\n\
    [outputs]\npos_m = { value = \"x_m\", sd = \"estimate\" }\n";

const SPRING: &str = "scenario = \"system\"\nname = \"spring\"\n[states]\nx_m = { start = \"pos_m\" }\n\
    v_m_s = { start = \"speed_m_s\" }\n[parameters]\nk_per_s2 = { nominal = 2.0, min = 0.0, max = 100.0 }\n\
    c_per_s = { nominal = 0.3, min = 0.0, max = 10.0 }\n[rates]\nx_m = \"v_m_s\"\n\
    v_m_s = \"-k_per_s2 * x_m - c_per_s * v_m_s\"\n[outputs]\npos_m = { value = \"x_m\", sd = \"estimate\" }\n\
    speed_m_s = { value = \"v_m_s\", sd = \"estimate\" }\n";

/// Pseudo-random noise of measurement number `k`, between -1 and 1; the caller scales it.
fn error(k: usize) -> f64 {
    ((k as f64 * 12.9898).sin() * 43_758.545_3).fract()
}

/// Writes records of `exp(-0.7 t)` with `rows` samples each.
fn decays(path: &Path, records: usize, rows: impl Fn(usize) -> usize) {
    let mut text = "trajectory,t_s,pos_m\n".to_owned();
    for r in 0..records {
        for k in 0..rows(r) {
            let (t, start) = (0.1 * k as f64, 1.0 + 0.1 * r as f64);
            text += &format!("{r},{t:.1},{:.6}\n", start * (-0.7 * t).exp() + 1e-3 * error(100 * r + k));
        }
    }
    std::fs::write(path, text).expect("written");
}

#[test]
fn records_without_later_samples_have_no_error() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    std::fs::write(d.join("decay.toml"), DECAY).expect("written");
    decays(&d.join("short.csv"), 10, |_| 5);
    let evaluate = ["evaluate", "decay.toml", "--data", "short.csv"];
    fail(3, &evaluate, d, &["short.csv", "after the first 5", "--burn-in"]);
    fail(3, &["discover", "decay.toml", "short.csv"], d, &["short.csv", "first 5 samples", "augsim fit"]);
    let predict = ["predict", "decay.toml", "--data", "short.csv", "--samples", "20", "--out", "f.csv"];
    let text = succeed(&predict, d);
    assert!(text.contains("there is no error") && !text.contains("0.0000"), "{text}");
    // With a shorter burn-in there is something to score.
    let scored = succeed_json(&[&evaluate[..], &["--burn-in", "2"]].concat(), d);
    assert_eq!(scored["rows"][0]["samples"], 30);
    // Some short records among long ones are named.
    decays(&d.join("mixed.csv"), 4, |r| if r == 2 { 4 } else { 30 });
    let out = augsim(&["evaluate", "decay.toml", "--data", "mixed.csv"], d);
    let note = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success() && note.contains("not scored") && note.contains(": 2"), "{note}");
}

#[test]
fn sensors_in_alternate_rows_are_searched() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    std::fs::write(d.join("spring.toml"), SPRING).expect("written");
    let mut text = "trajectory,t_s,pos_m,speed_m_s\n".to_owned();
    for r in 0..8 {
        let (mut x, mut v) = (1.0 + 0.2 * f64::from(r), 0.0);
        for k in 0..80 {
            let noise = 2e-3 * error(100 * r as usize + k);
            let t = 0.1 * k as f64;
            text += &match k % 2 {
                0 => format!("{r},{t:.1},{:.6},\n", x + noise),
                _ => format!("{r},{t:.1},,{:.6}\n", v + noise),
            };
            for _ in 0..1000 {
                (x, v) = (x + 1e-4 * v, v + 1e-4 * (-2.0 * x - 0.3 * v));
            }
        }
    }
    std::fs::write(d.join("alternate.csv"), text).expect("written");
    let found = succeed_json(&["discover", "spring.toml", "alternate.csv", "--null-runs", "0"], d);
    assert_eq!(found["verdict"], "nothing-to-add", "{}", found["sentence"]);
    let noise = found["noise"]["sd"].as_f64().expect("a number");
    // Uniform errors of 2 mm have a standard deviation of 2 / sqrt(3) = 1.15 mm.
    assert!((0.6e-3..2.4e-3).contains(&noise), "{noise}");
}

#[test]
fn the_number_of_draws_is_bounded() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    std::fs::write(d.join("decay.toml"), DECAY).expect("written");
    decays(&d.join("data.csv"), 2, |_| 30);
    let predict = ["predict", "decay.toml", "--data", "data.csv", "--samples", "1000000000"];
    fail(2, &predict, d, &["--samples 1000000000", "at most 100000"]);
}
