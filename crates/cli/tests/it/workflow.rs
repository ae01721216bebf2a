//! Contract: the output of one command is valid input of the next; JSON output is JSON; a forecast
//! depends on the first state only.

use crate::command::succeed;
use std::process::Command;

#[test]
fn simulate_train_predict_evaluate() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    succeed(&["simulate", "--trajectories", "20", "--samples", "60", "--out", "train.csv.gz"], d);
    succeed(&["simulate", "--trajectories", "6", "--samples", "60", "--seed", "9", "--out", "test.csv"], d);
    let truth = std::fs::read_to_string(d.join("test.truth.csv")).unwrap();
    assert_eq!(truth.lines().next(), Some("trajectory,drop_height_m,restitution"));
    assert_eq!(truth.lines().count(), 7);

    let inspected: serde_json::Value =
        serde_json::from_str(&succeed(&["data", "inspect", "test.csv", "--json"], d)).unwrap();
    assert!(inspected.to_string().contains("height_m"));

    for recipe in ["neural", "hybrid", "hybrid-standardised", "hybrid-plus"] {
        succeed(
            &[
                "train",
                "--pybullet-ball",
                "--data",
                "train.csv.gz",
                "--recipe",
                recipe,
                "--iterations",
                "5",
                "--out",
                recipe,
            ],
            d,
        );
        let score = succeed(&["evaluate", recipe, "--data", "test.csv", "--json"], d);
        let score: serde_json::Value = serde_json::from_str(&score).unwrap();
        assert_eq!(score["protocol"], "forecast");
        assert!(score["pos_m"].as_f64().unwrap() > 0.0);
        let reconstruction =
            succeed(&["evaluate", recipe, "--data", "test.csv", "--protocol", "reconstruction"], d);
        assert!(reconstruction.contains("not a prediction"));
    }

    let predict = |data: &str| {
        succeed(&["predict", "hybrid-plus", "--data", data, "--samples", "20", "--out", "forecast.csv"], d);
        std::fs::read_to_string(d.join("forecast.csv")).unwrap()
    };
    let forecast = predict("test.csv");
    let header = forecast.lines().next().unwrap();
    assert!(header.starts_with("trajectory,t_s,mean_height_m,median_height_m,q05_height_m"), "{header}");
    assert_eq!(forecast.lines().count(), 1 + 6 * 60);
    // Other data after the same first state.
    let test = std::fs::read_to_string(d.join("test.csv")).unwrap();
    let changed: String = test
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [id, t, _, _] if t != "t_s" && t != "0" => format!("{id},{t},1,2\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    std::fs::write(d.join("changed.csv"), changed).unwrap();
    assert_eq!(predict("changed.csv"), forecast);
}

#[test]
fn reproduce_without_data_generates_drops_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let args = ["reproduce", "ball", "--iterations", "2", "--test-drops", "100"];
    let out =
        Command::new(env!("CARGO_BIN_EXE_augsim")).args(args).args(["--out", "ball"]).current_dir(d).output();
    let out = out.unwrap();
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "{error}");
    let text = std::fs::read_to_string(d.join("ball/result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(result["schema"], "augsim.reproduce/1");
    assert_eq!(result["test_set"], "generated");
    let row = |model: &str, protocol: &str| {
        let rows = result["rows"].as_array().unwrap();
        rows.iter().find(|r| r["model"] == model && r["protocol"] == protocol).unwrap().clone()
    };
    // 100 other drops: their errors are within three standard deviations of such a set (0.017, 0.0095
    // and 0.013 m).
    assert!((row("Zero", "forecast")["pos_m"].as_f64().unwrap() - 0.642).abs() < 0.051);
    assert!((row("Physics", "forecast")["pos_m"].as_f64().unwrap() - 0.168).abs() < 0.029);
    assert!((row("Floor", "floor")["pos_m"].as_f64().unwrap() - 0.111).abs() < 0.039);
    for recipe in ["Neural", "Hybrid", "Hybrid+"] {
        assert!(row(recipe, "reconstruction")["crps_pos_m"].as_f64().is_some());
    }
    assert!(std::fs::read_to_string(d.join("ball/report.html")).unwrap().contains("generated"));
}
