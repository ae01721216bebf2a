//! Contract: the commands in a discovery report work: `simulate` and `predict` write trajectories with
//! bands, `evaluate` compares with the declared and calibrated models; networks are trained on all data
//! that `discover` accepts, no system is assumed by default, and `evaluate` states correctly whether a
//! network improves forecasts.

use crate::command::{augsim, fail, succeed, succeed_json};
use std::path::Path;
use std::time::Instant;

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
    restitution = { nominal = 0.7, min = 0.0, max = 1.0 }\n[sensor]\nposition_sd_m = 0.002\n";
const DRAG: f64 = 0.08;
/// Number of throws in the data set: enough that the discovery holds some out.
const THROWS: u64 = 24;

/// Generator of pseudo-random numbers between -1 and 1; sums of twelve are about normal.
struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Writes throws with quadratic drag `k` and restitution 0.7 over a floor at `floor_m`: positions on an
/// irregular clock, integrated by the test with steps of 0.2 ms.
fn throws(path: &Path, k: f64, floor_m: f64, seed: u64) {
    let mut text = "trajectory,t_s,x_m,z_m\n".to_owned();
    let mut draws = Draws(seed);
    for i in 0..THROWS {
        let (mut x, mut z) = (0.0, 1.0 + 0.6 * draws.uniform());
        let (mut vx, mut vz) = (1.0 + 2.0 * draws.uniform(), 1.5 * draws.uniform());
        let (step, mut t, mut next) = (2e-4, 0.0, 0.0);
        while t < 1.2 {
            if t >= next {
                let noise = [draws.normal(), draws.normal()].map(|e| 0.002 * e);
                text += &format!("{i},{t:.4},{:.5},{:.5}\n", x + noise[0], z + floor_m + noise[1]);
                next += 0.01 + 0.006 * draws.uniform();
            }
            let v = f64::hypot(vx, vz);
            (vx, vz) = (vx - k * v * vx * step, vz - (9.81 + k * v * vz) * step);
            (x, z, t) = (x + vx * step, z + vz * step, t + step);
            if z < 0.0 && vz < 0.0 {
                (z, vz) = (-0.7 * z, -0.7 * vz);
            }
        }
    }
    std::fs::write(path, text).expect("it can be written");
}

#[test]
fn simulates_predicts_and_scores_a_discovery() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    throws(&d.join("throws.csv"), DRAG, 0.0, 5);
    std::fs::write(d.join("declared.toml"), MODEL).expect("written");
    let found = succeed_json(&["discover", "declared.toml", "throws.csv", "--out", "found"], d);
    assert_eq!(found["effects"][0]["kind"], "quadratic-drag", "{found}");

    // The folder and its model file are the same model.
    let told = succeed(&["predict", "found", "--data", "throws.csv", "--out", "a.csv"], d);
    assert!(told.contains("before its first impact") && told.contains("90 % band"), "{told}");
    succeed(&["predict", "found/model.toml", "--data", "throws.csv", "--out", "b.csv"], d);
    let read = |name: &str| std::fs::read_to_string(d.join(name)).expect("a forecast");
    assert_eq!(read("a.csv"), read("b.csv"));
    assert!(
        read("a.csv").starts_with("trajectory,t_s,mean_x_m,median_x_m,q05_x_m,"),
        "{}",
        &read("a.csv")[..99]
    );
    succeed(&["simulate", "--model", "found", "--like", "throws.csv", "--out", "c.csv"], d);
    succeed(&["simulate", "found/model.toml", "--like", "throws.csv", "--out", "d.csv"], d);
    assert_eq!(read("c.csv"), read("d.csv"));
    assert!(read("c.csv").starts_with("trajectory,t_s,x_m,q05_x_m,q95_x_m,z_m,"), "{}", &read("c.csv")[..99]);

    // On its own data a discovery is scored on the held-out trajectories with the errors of its report.
    let scored = succeed_json(&["evaluate", "found", "--data", "throws.csv"], d);
    assert_eq!(scored["held_out"], true);
    assert_eq!(scored["trajectories"], found["error"]["heldout_trajectories"]);
    let error = |row: usize| scored["rows"][row]["rmse"].as_f64().expect("an error");
    for (row, name) in ["declared", "calibrated", "augmented"].into_iter().enumerate() {
        assert_eq!(scored["rows"][row]["model"], name);
        let reported = found["error"][name]["rmse"].as_f64().expect("an error");
        assert!((error(row) / reported - 1.0).abs() < 0.08, "{name}: {} and {reported}", error(row));
    }
    assert!(
        scored["verdict"]
            .as_str()
            .is_some_and(|v| v.starts_with("the discovered model improves the forecasts")),
        "{scored}"
    );
    // On other data all trajectories are scored.
    throws(&d.join("fresh.csv"), DRAG, 0.0, 77);
    let scored = succeed_json(&["evaluate", "found", "--data", "fresh.csv", "--require-pos-m", "0.02"], d);
    assert_eq!((scored["held_out"].as_bool(), scored["trajectories"].as_u64()), (Some(false), Some(THROWS)));
    let inside = scored["rows"][2]["coverage90"].as_f64().expect("a share");
    assert!((0.85..=0.96).contains(&inside), "{inside}");
    let strict = augsim(&["evaluate", "found", "--data", "fresh.csv", "--require-pos-m", "1e-6"], d);
    assert_eq!(strict.status.code(), Some(1));

    std::fs::create_dir(d.join("empty")).expect("a folder");
    fail(2, &["predict", "empty", "--data", "throws.csv"], d, &["empty", "model.toml", "discover"]);
    fail(2, &["simulate", "found"], d, &["--like DATA"]);
}

#[test]
fn a_network_on_the_residual_does_not_improve_a_complete_model() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    // The floor of a tracker can be at any height.
    throws(&d.join("throws.csv"), DRAG, 0.3, 5);
    throws(&d.join("fresh.csv"), DRAG, 0.3, 78);
    std::fs::write(d.join("declared.toml"), MODEL).expect("written");
    let found = succeed_json(&["discover", "declared.toml", "throws.csv", "--out", "found"], d);
    assert!(found["effects"].to_string().contains("quadratic-drag"), "{}", found["sentence"]);

    let train = ["train", "--recipe", "hybrid-plus", "--data", "throws.csv", "--iterations", "30"];
    let out = augsim(&[&train[..], &["--residual-of", "found", "--out", "net"]].concat(), d);
    let notes = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success() && notes.contains("velocity_x_m_s"), "{notes}");
    let scored = succeed_json(&["evaluate", "net", "--data", "fresh.csv"], d);
    let names: Vec<&str> =
        scored["rows"].as_array().expect("rows").iter().filter_map(|r| r["model"].as_str()).collect();
    assert_eq!(names, ["Physics declared", "Physics calibrated", "Physics augmented", "Hybrid+"]);
    let error = |row: usize| scored["rows"][row]["pos_m"].as_f64().expect("an error");
    assert!(error(2) < 0.5 * error(1) && error(2) < 0.03, "{scored}");
    let verdict = scored["verdict"].as_str().expect("a verdict");
    assert!(!verdict.starts_with("the net improves"), "the model is complete, but {verdict}");
    succeed(&["predict", "net", "--data", "fresh.csv", "--samples", "8", "--out", "forecast.csv"], d);

    // The declared model alone, and no model.
    let declared = [&train[..], &["--model", "declared.toml", "--out", "plain"]].concat();
    succeed(&declared, d);
    let scored = succeed_json(&["evaluate", "plain", "--data", "fresh.csv"], d);
    assert_eq!(scored["rows"][0]["model"], "Physics");
    fail(
        2,
        &[&train[..], &["--out", "none"]].concat(),
        d,
        &["throws.csv", "no physics model is given", "--model FILE", "--residual-of RUN"],
    );
    assert!(!d.join("none/config.resolved.toml").exists());
}

#[test]
fn reports_the_first_step_of_a_diverging_forecast() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["simulate", "--trajectories", "8", "--samples", "40", "--out", "drops.csv"], d);
    let train = ["train", "--pybullet-ball", "--data", "drops.csv", "--iterations", "3", "--out", "net"];
    succeed(&train, d);
    // A height of 1e39 m is valid in a file but overflows in 32-bit floats.
    let text = std::fs::read_to_string(d.join("drops.csv")).expect("drops");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let first: Vec<&str> = lines[1].split(',').collect();
    lines[1] = format!("{},{},1e39,{}", first[0], first[1], first[3]);
    std::fs::write(d.join("far.csv"), lines.join("\n") + "\n").expect("written");
    for command in [&["evaluate", "net"][..], &["predict", "net", "--out", "forecast.csv"]] {
        fail(4, &[command, &["--data", "far.csv"]].concat(), d, &["trajectory `0`", "diverged at step 0"]);
    }
    assert!(!d.join("forecast.csv").exists());
}

#[test]
fn a_time_limit_returns_the_best_model_so_far() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    throws(&d.join("throws.csv"), DRAG, 0.0, 5);
    std::fs::write(d.join("declared.toml"), MODEL).expect("written");
    let discover = ["discover", "declared.toml", "throws.csv"];
    fail(
        4,
        &[&discover[..], &["--time-limit", "0.001", "--out", "none"]].concat(),
        d,
        &["--time-limit", "before the model was calibrated"],
    );
    assert!(!d.join("none/result.json").exists());
    // A limit that is not reached changes nothing.
    let start = Instant::now();
    let whole = succeed_json(&[&discover[..], &["--out", "whole"]].concat(), d);
    let seconds = start.elapsed().as_secs_f64();
    let enough = succeed_json(&[&discover[..], &["--time-limit", "600", "--out", "enough"]].concat(), d);
    assert_eq!(whole, enough);
    assert!(whole["cut_after_s"].is_null());
    // In three fifths of the time the model is calibrated, but the result is not complete.
    let limit = 0.6 * seconds;
    let start = Instant::now();
    let limited = ["--time-limit", &limit.to_string(), "--out", "cut"];
    let cut = succeed_json(&[&discover[..], &limited].concat(), d);
    assert!(start.elapsed().as_secs_f64() < 1.1 * limit + 2.0, "{:?} of {limit} s", start.elapsed());
    assert!(cut["cut_after_s"].as_f64().is_some_and(|s| s > 0.0), "{cut}");
    let sentence = cut["sentence"].as_str().expect("a sentence");
    assert!(sentence.starts_with("The search was stopped at its time limit"), "{sentence}");
    assert!(
        std::fs::read_to_string(d.join("cut/report.html"))
            .expect("a page")
            .contains("The search was stopped")
    );
    fail(2, &[&discover[..], &["--time-limit", "0", "--out", "no"]].concat(), d, &["--time-limit 0"]);
}

#[test]
fn writes_single_figures_of_a_report() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    throws(&d.join("throws.csv"), DRAG, 0.0, 5);
    std::fs::write(d.join("declared.toml"), MODEL).expect("written");
    succeed(&["discover", "declared.toml", "throws.csv", "--out", "found"], d);
    let names = succeed(&["report", "found"], d);
    for name in ["best", "best-2", "median", "worst", "against-time"] {
        assert!(names.lines().any(|n| n == name), "{name} is not in {names}");
    }
    succeed(&["report", "found", "--figure", "worst", "--out", "worst.svg"], d);
    let svg = std::fs::read_to_string(d.join("worst.svg")).expect("a figure");
    assert!(svg.starts_with("<svg") && svg.contains("time (s)"), "{}", &svg[..200]);
    fail(2, &["report", "found", "--figure", "wurst"], d, &["no figure `wurst`", "worst"]);
    fail(2, &["report", "found", "--figure", "worst", "--out", "worst.gif"], d, &[".svg"]);
    let page = std::fs::read_to_string(d.join("found/report.html")).expect("a page");
    let first = |text: &str| page.find(text).unwrap_or_else(|| panic!("`{text}` is not on the page"));
    assert!(first("What was found") < first("Held-out trajectories"), "the findings come first");
    assert!(
        page.contains("augsim predict model.toml --data DATA") && page.contains("throws: what"),
        "names of commands, of data"
    );
}
