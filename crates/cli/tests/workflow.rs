//! Contract: what one command writes the next one reads; JSON output is JSON; a forecast depends on the
//! first state only.

use std::path::Path;
use std::process::Command;

fn augsim(args: &[&str], dir: &Path) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_augsim")).args(args).current_dir(dir).output().unwrap();
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

#[test]
fn simulate_train_predict_evaluate() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    augsim(&["simulate", "--trajectories", "20", "--samples", "60", "--out", "train.csv.gz"], d);
    augsim(&["simulate", "--trajectories", "6", "--samples", "60", "--seed", "9", "--out", "test.csv"], d);
    let truth = std::fs::read_to_string(d.join("test.truth.csv")).unwrap();
    assert_eq!(truth.lines().next(), Some("trajectory,drop_height_m,restitution"));
    assert_eq!(truth.lines().count(), 7);

    let inspected: serde_json::Value =
        serde_json::from_str(&augsim(&["data", "inspect", "test.csv", "--json"], d)).unwrap();
    assert!(inspected.to_string().contains("height_m"));

    for recipe in ["neural", "hybrid", "hybrid-plus"] {
        augsim(
            &["train", "--data", "train.csv.gz", "--recipe", recipe, "--iterations", "5", "--out", recipe],
            d,
        );
        let score = augsim(&["evaluate", recipe, "--data", "test.csv", "--json"], d);
        let score: serde_json::Value = serde_json::from_str(&score).unwrap();
        assert_eq!(score["protocol"], "forecast");
        assert!(score["pos_m"].as_f64().unwrap() > 0.0);
        let reconstruction =
            augsim(&["evaluate", recipe, "--data", "test.csv", "--protocol", "reconstruction"], d);
        assert!(reconstruction.contains("not a prediction"));
    }

    let predict = |data: &str| {
        augsim(&["predict", "hybrid-plus", "--data", data, "--samples", "20", "--out", "forecast.csv"], d);
        std::fs::read_to_string(d.join("forecast.csv")).unwrap()
    };
    let forecast = predict("test.csv");
    let header = forecast.lines().next().unwrap();
    assert!(header.starts_with("trajectory,t_s,mean_height_m,median_height_m,q05_height_m"), "{header}");
    assert_eq!(forecast.lines().count(), 1 + 6 * 60);
    // Another future after the same first state.
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
