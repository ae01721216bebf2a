//! Contract: `predict --seen` and `evaluate --protocol filtered` accept a model file, a discovery folder
//! or a network, use only the measured prefix, and reject a wrong prefix with one sentence. The test
//! generates drops in closed form, and compares forecasts for data that differ after the prefix.

use crate::command::{augsim, succeed, succeed_json};
use std::path::Path;

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
    restitution = { nominal = 0.7, min = 0.0, max = 1.0 }\n[sensor]\nposition_sd_m = 0.002\n[[effect]]\n\
    kind = \"restitution-scatter\"\nper = \"trajectory\"\nsd = { nominal = 0.05, min = 0.0, max = 0.5 }\n";

/// Generator of approximately standard normal numbers (linear congruential).
struct Draws(u64);

impl Draws {
    fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Writes drops from about 1 m, sampled every 10 ms for 1.1 s, with two rebounds, 2 mm noise and a
/// restitution per drop. From row `other` on the heights differ.
fn drops(path: &Path, count: usize, other: usize) {
    let mut draws = Draws(3);
    let mut text = "trajectory,t_s,height_m\n".to_owned();
    for i in 0..count {
        let (height, e) = (1.0 + 0.05 * draws.normal(), 0.7 + 0.05 * draws.normal());
        let (mut z, mut v, mut since) = (height, 0.0, 0.0);
        for k in 0..110 {
            let t = 0.01 * f64::from(k);
            // Next impact of the parabola that started at `since`.
            loop {
                let fall = (v + f64::sqrt(v * v + 2.0 * 9.81 * z)) / 9.81;
                if t < since + fall {
                    break;
                }
                v = e * (9.81 * fall - v);
                (since, z) = (since + fall, 0.0);
            }
            let u = t - since;
            let read = z + v * u - 0.5 * 9.81 * u * u + 0.002 * draws.normal();
            let told = if k as usize >= other { read + 0.3 } else { read };
            text += &format!("{i},{t:.2},{told:.5}\n");
        }
    }
    std::fs::write(path, text).expect("it can be written");
}

#[test]
fn a_measured_rebound_narrows_the_forecast_with_correct_coverage() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    drops(&d.join("drops.csv"), 40, usize::MAX);
    std::fs::write(d.join("model.toml"), MODEL).expect("written");
    let scored = succeed_json(
        &[
            "evaluate",
            "model.toml",
            "--data",
            "drops.csv",
            "--protocol",
            "filtered",
            "--seen",
            "20,0.3s,60,80",
        ],
        d,
    );
    let figure = |row: usize, key: &str| scored["rows"][row]["measures"][0][key].as_f64().expect("a figure");
    let seen: Vec<_> = (0..4).map(|row| scored["rows"][row]["seen"].as_str().expect("a prefix")).collect();
    assert_eq!(seen, ["20", "0.3s", "60", "80"]);
    // A restitution of 0.7 +- 0.05 gives decimetres after a second; a measured rebound reduces this to a
    // few millimetres.
    assert!(figure(1, "rest") > 8.0 * figure(3, "rest"), "{scored}");
    let late = [0, 1].map(|row| figure(row, "common"));
    assert!(late[1] < 1.05 * late[0], "{late:?}");
    for row in 0..4 {
        let inside = scored["rows"][row]["coverage90"].as_f64().expect("a share");
        assert!((0.84..=0.96).contains(&inside), "row {row}: {inside}");
        assert_eq!(scored["rows"][row]["trajectories"], 40);
        assert_eq!(scored["rows"][row]["protocol"], "filtered");
    }
    let told = succeed(
        &["evaluate", "model.toml", "--data", "drops.csv", "--protocol", "filtered", "--seen", "60"],
        d,
    );
    assert!(told.contains("height_m") && told.contains(" m ") && told.contains("seen"), "{told}");
}

#[test]
fn a_forecast_uses_only_the_prefix_on_any_number_of_threads() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    drops(&d.join("drops.csv"), 4, usize::MAX);
    drops(&d.join("other.csv"), 4, 60);
    std::fs::write(d.join("model.toml"), MODEL).expect("written");
    let bytes = |data: &str, out: &str, threads: &str| {
        let args =
            ["predict", "model.toml", "--data", data, "--seen", "60", "--threads", threads, "--out", out];
        let told = succeed(&args, d);
        assert!(told.contains("from the first 60 samples"), "{told}");
        std::fs::read(d.join(out)).expect("a forecast")
    };
    let first = bytes("drops.csv", "a.csv", "1");
    assert_eq!(first, bytes("drops.csv", "b.csv", "2"));
    assert_eq!(first, bytes("other.csv", "c.csv", "2"), "a later row was read");
    // The order of rows in the file does not matter.
    let text = std::fs::read_to_string(d.join("drops.csv")).expect("it is there");
    let mut lines: Vec<&str> = text.lines().collect();
    lines.swap(5, 6);
    std::fs::write(d.join("unsorted.csv"), lines.join("\n")).expect("written");
    assert_eq!(first, bytes("unsorted.csv", "d.csv", "1"));
    let text = String::from_utf8(first).expect("text");
    assert!(text.starts_with("trajectory,t_s,mean_height_m,"), "{}", &text[..60]);
    assert_eq!(text.lines().count(), 1 + 4 * 50);
}

#[test]
fn a_network_with_one_measured_row_gives_its_usual_forecast() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["simulate", "--trajectories", "6", "--samples", "100", "--out", "drops.csv"], d);
    let train = ["train", "--data", "drops.csv", "--pybullet-ball", "--iterations", "20", "--out", "net"];
    succeed(&train, d);
    succeed(&["predict", "net", "--data", "drops.csv", "--out", "whole.csv"], d);
    succeed(&["predict", "net", "--data", "drops.csv", "--seen", "1", "--out", "behind.csv"], d);
    let rows = |name: &str| -> Vec<String> {
        let text = std::fs::read_to_string(d.join(name)).expect("a forecast");
        text.lines()
            .filter(|line| !line.contains(",0,") && !line.starts_with("trajectory"))
            .map(str::to_owned)
            .collect()
    };
    let (whole, behind) = (rows("whole.csv"), rows("behind.csv"));
    assert_eq!(behind.len(), 6 * 99);
    assert!(behind.iter().all(|row| whole.contains(row)), "n = 1 is the forecast from the first state");
    let args = ["evaluate", "net", "--data", "drops.csv", "--protocol", "filtered", "--seen", "30,70"];
    let view = ["--seen-columns", "height_m", "--sensor-sd", "0.002"];
    let scored = succeed_json(&[&args[..], &view].concat(), d);
    let names: Vec<_> = (0..4).map(|row| scored["rows"][row]["model"].as_str().expect("a name")).collect();
    assert_eq!(names, ["Physics", "Physics", "Hybrid+", "Hybrid+"]);

    // A network needs every sample; the error names a missing value.
    let text = std::fs::read_to_string(d.join("drops.csv")).expect("it is there");
    let gap = |(i, line): (usize, &str)| match i {
        9 => format!("{},NaN", line.rsplit_once(',').map_or("", |(head, _)| head)),
        _ => line.to_owned(),
    };
    let gaps: Vec<String> = text.lines().enumerate().map(gap).collect();
    std::fs::write(d.join("gaps.csv"), gaps.join("\n")).expect("written");
    let out = augsim(&["predict", "net", "--data", "gaps.csv", "--seen", "30"], d);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(
        out.status.code() == Some(3) && error.contains("gaps.csv") && error.contains("velocity_m_s"),
        "{error}"
    );
}

#[test]
fn rejects_a_wrong_prefix_with_one_sentence() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    drops(&d.join("drops.csv"), 3, usize::MAX);
    std::fs::write(d.join("model.toml"), MODEL).expect("written");
    let refused = |args: &[&str], code: i32, words: &[&str]| {
        for command in [&["predict", "model.toml"][..], &["evaluate", "model.toml", "--protocol", "filtered"]]
        {
            let out = augsim(&[command, args].concat(), d);
            let error = String::from_utf8_lossy(&out.stderr).into_owned();
            assert_eq!(out.status.code(), Some(code), "{command:?} {args:?}: {error}");
            assert_eq!(error.trim().lines().count(), 1, "{error}");
            for word in words {
                assert!(error.contains(word), "{command:?} {args:?}: `{word}` is not in: {error}");
            }
        }
    };
    refused(
        &["--data", "drops.csv", "--seen", "1"],
        3,
        &["trajectory `0`", "2 measured values", "observe more rows"],
    );
    refused(&["--data", "drops.csv", "--seen", "0"], 2, &["--seen 0", "at least one row"]);
    refused(
        &["--data", "drops.csv", "--seen", "110"],
        2,
        &["--seen 110", "110 samples", "give a shorter prefix"],
    );
    refused(&["--data", "drops.csv", "--seen", "9s"], 2, &["--seen 9s", "give a shorter prefix"]);
    refused(&["--data", "drops.csv", "--seen", "0.5"], 2, &["--seen 0.5", "0.5s"]);
    refused(&["--data", "drops.csv", "--seen", "60", "--seen-columns", "z_m"], 2, &["z_m", "height_m"]);
    refused(&["--data", "drops.csv", "--seen", "60", "--sensor-sd=-1"], 2, &["--sensor-sd -1"]);
    let out = augsim(&["evaluate", "model.toml", "--data", "drops.csv", "--seen", "60"], d);
    assert_eq!(out.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&out.stderr).contains("--protocol filtered"));
    let args = ["evaluate", "model.toml", "--data", "drops.csv", "--protocol", "filtered", "--seen", "60,30"];
    let out = augsim(&args, d);
    assert_eq!(out.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&out.stderr).contains("in increasing order"));
}

#[test]
fn asks_for_measured_data_and_rejects_unknown_scenarios() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let refused = |args: &[&str], words: &[&str]| {
        let out = augsim(args, d);
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{args:?}: {error}");
        for word in words {
            assert!(error.contains(word), "{args:?}: `{word}` is not in: {error}");
        }
    };
    refused(&["reproduce", "filtered", "--scenario", "flights"], &["spindoe-table-tennis", "--data"]);
    refused(&["reproduce", "league", "--scenario", "flights"], &["--scenario flights", "ball and push"]);
    refused(&["reproduce", "loop", "--scenario", "ball"], &["--scenario", "league", "filtered"]);
}
