//! Contract: `train --residual-of` uses the discovered model as the physics of the network, for balls
//! with any uniform step and for pushes; the run contains that model, can be resumed, and is used by
//! `predict` and `evaluate`. Unsuitable folders, data and recipes are rejected with one sentence before
//! any output.

use crate::command::{augsim, succeed, succeed_json};
use std::path::Path;

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.8, frozen = true }\n\
    restitution = 0.55\n";
const DRAG: &str = "[[effect]]\nkind = \"quadratic-drag\"\nk_per_m = 0.02\n";

/// Writes ball drops in free fall from 2 m, sampled at 50 Hz (the simulator of the paper has another rate).
fn drops(path: &Path) {
    let mut text = "trajectory,t_s,height_m,velocity_m_s\n".to_owned();
    for i in 0..8 {
        for k in 0..30 {
            let t = 0.02 * f64::from(k);
            text.push_str(&format!("{i},{t},{},{}\n", 2.0 + 0.1 * f64::from(i) - 4.9 * t * t, -9.8 * t));
        }
    }
    std::fs::write(path, text).expect("it can be written");
}

fn found(dir: &Path, name: &str, model: &str) {
    std::fs::create_dir(dir.join(name)).expect("a folder");
    std::fs::write(dir.join(name).join("model.toml"), model).expect("it can be written");
}

#[test]
fn trains_a_network_on_a_discovery_of_drops() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    succeed(&["simulate", "--trajectories", "16", "--samples", "150", "--out", "drops.csv.gz"], d);
    std::fs::write(d.join("declared.toml"), format!("{MODEL}[sensor]\nposition_sd_m = 0.03\n"))
        .expect("written");
    succeed(&["discover", "declared.toml", "drops.csv.gz", "--out", "found"], d);
    let model = std::fs::read_to_string(d.join("found/model.toml")).expect("a model");

    let train = |out: &str, more: &[&str]| {
        let args =
            ["train", "--residual-of", "found", "--data", "drops.csv.gz", "--iterations", "20", "--out", out];
        succeed(&[&args[..], more].concat(), d);
        std::fs::read(d.join(out).join("weights.safetensors")).expect("weights")
    };
    let plus = train("plus", &[]);
    assert!(plus != train("hybrid", &["--recipe", "hybrid"]), "two recipes, one net");
    let config = std::fs::read_to_string(d.join("plus/config.resolved.toml")).expect("a configuration");
    assert!(config.contains("[settings.engine.model]") && config.contains("hybrid-plus"), "{config}");
    for line in model.lines().filter(|l| l.contains("restitution")) {
        assert!(config.contains(line), "`{line}` of the model is not in the configuration");
    }
    // A finished run resumes to the same bytes with its own settings.
    succeed(&["train", "--resume", "--out", "plus"], d);
    assert_eq!(std::fs::read(d.join("plus/weights.safetensors")).expect("weights"), plus);

    for run in ["plus", "hybrid"] {
        let score = succeed_json(&["evaluate", run, "--data", "drops.csv.gz"], d);
        assert!(score["pos_m"].as_f64().is_some_and(|e| e > 0.0 && e < 3.0), "{score}");
        succeed(&["predict", run, "--data", "drops.csv.gz", "--samples", "4", "--out", "forecast.csv"], d);
        let forecast = std::fs::read_to_string(d.join("forecast.csv")).expect("a forecast");
        assert_eq!(forecast.lines().count(), 1 + 16 * 150);
    }
}

#[test]
fn uses_the_step_of_the_data_and_the_given_model() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    drops(&d.join("drops.csv"));
    found(d, "plain", MODEL);
    found(d, "drag", &(MODEL.to_owned() + DRAG));
    let error = |name: &str| {
        let out = format!("{name}-net");
        let args =
            ["train", "--residual-of", name, "--data", "drops.csv", "--iterations", "1", "--out", &out];
        succeed(&[&args[..], &["--seed", "3"]].concat(), d);
        let score = succeed_json(&["evaluate", &out, "--data", "drops.csv"], d);
        score["pos_m"].as_f64().expect("an error")
    };
    // The data are free fall, so after one iteration the error is that of the physics.
    let (plain, drag) = (error("plain"), error("drag"));
    assert!(plain < 0.5 * drag, "without drag {plain} m, with it {drag} m");
    let config = std::fs::read_to_string(d.join("drag-net/config.resolved.toml")).expect("a configuration");
    assert!(config.contains("step_s = 0.02"), "{config}");

    succeed(&["simulate", "--trajectories", "3", "--samples", "40", "--out", "other.csv"], d);
    // States at another step are computed from positions at the step of the network.
    let score = succeed_json(&["evaluate", "drag-net", "--data", "other.csv"], d);
    assert!(score["pos_m"].as_f64().is_some_and(f64::is_finite), "{score}");
}

#[test]
fn trains_scores_and_predicts_pushes() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let simulate = ["simulate", "--scenario", "push", "--protocol", "random", "--trajectories", "12"];
    succeed(&[&simulate[..], &["--out", "pushes.csv"]].concat(), d);
    let declared = std::fs::read_to_string(d.join("pushes.model.toml")).expect("a model");
    found(
        d,
        "found",
        &(declared.clone() + "\n[[effect]]\nkind = \"table-anisotropy\"\nratio = 1.2\nangle_rad = 0.4\n"),
    );
    let args =
        ["train", "--residual-of", "found", "--data", "pushes.csv", "--iterations", "5", "--out", "net"];
    succeed(&args, d);
    let config = std::fs::read_to_string(d.join("net/config.resolved.toml")).expect("a configuration");
    assert!(config.contains("table-anisotropy") && config.contains("1.2"), "{config}");
    succeed(&["train", "--resume", "--out", "net"], d);
    let score = succeed_json(&["evaluate", "net", "--data", "pushes.csv"], d);
    assert_eq!(
        (score["protocol"].as_str(), score["estimate"].as_str()),
        (Some("forecast"), Some("mean of 100"))
    );
    assert!(score["pos_mm"].as_f64().is_some_and(f64::is_finite), "{score}");
    succeed(&["predict", "net", "--data", "pushes.csv", "--samples", "4", "--out", "forecast.csv"], d);
    let forecast = std::fs::read_to_string(d.join("forecast.csv")).expect("a forecast");
    assert!(
        forecast.starts_with("trajectory,t_s,mean_x_m,"),
        "{}",
        forecast.lines().next().unwrap_or_default()
    );

    let outline = "polygon_m = [[0.045, 0.045], [-0.045, 0.045], [-0.045, -0.045], [0.045, -0.045]]";
    found(d, "outline", &declared.replace("object = \"rect1\"", outline));
    succeed(
        &["train", "--residual-of", "outline", "--data", "pushes.csv", "--iterations", "1", "--out", "own"],
        d,
    );

    let standardised =
        augsim(&[&args[..7], &["--recipe", "hybrid-standardised", "--out", "std"]].concat(), d);
    assert_eq!(standardised.status.code(), Some(2), "{}", String::from_utf8_lossy(&standardised.stderr));
    let reconstruction =
        augsim(&["evaluate", "net", "--data", "pushes.csv", "--protocol", "reconstruction"], d);
    assert_eq!(reconstruction.status.code(), Some(2));
}

#[test]
fn rejects_unsuitable_arguments_with_one_sentence() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    drops(&d.join("drops.csv"));
    std::fs::write(d.join("positions.csv"), "trajectory,t_s,height_m\na,0,2\na,0.1,1.9\n").expect("written");
    std::fs::create_dir(d.join("empty")).expect("a folder");
    found(d, "good", MODEL);
    found(d, "broken", "scenario = \"ball\"\n[[effect]]\nkind = \"quadratic-drug\"\n");
    found(d, "drift", &format!("{MODEL}[[effect]]\nkind = \"restitution-drift\"\nd_per_s = 0.001\n"));
    found(d, "polygon", "scenario = \"push\"\npolygon_m = [[0.05, 0.0], [-0.03, 0.04], [-0.03, -0.04]]\n");
    let refused = |found: &str, data: &str, more: &[&str], code: i32, texts: &[&str]| {
        let args = ["train", "--residual-of", found, "--data", data, "--iterations", "2", "--out", "net"];
        let out = augsim(&[&args[..], more].concat(), d);
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(code), "{found}, {data}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "one error, one paragraph: {error}");
        for text in texts {
            assert!(error.contains(text), "{found}, {data}: `{text}` is not in: {error}");
        }
        assert!(!d.join("net/config.resolved.toml").exists() && !d.join("net/checkpoint.bin").exists());
    };
    refused("absent", "drops.csv", &[], 3, &["absent", "model.toml", "augsim discover"]);
    refused("empty", "drops.csv", &[], 3, &["empty", "model.toml", "augsim discover"]);
    refused("broken", "drops.csv", &[], 3, &["broken/model.toml:3", "did you mean `quadratic-drag`"]);
    refused("drift", "drops.csv", &[], 3, &["drift/model.toml", "restitution-drift", "remove the effect"]);
    refused("polygon", "drops.csv", &[], 3, &["drops.csv", "no column `x_m`"]);
    refused("good", "positions.csv", &[], 3, &["positions.csv", "enough samples"]);
    refused("good", "nowhere.csv", &[], 3, &["nowhere.csv"]);
    refused("good", "drops.csv", &["--recipe", "neural"], 2, &["physics", "hybrid"]);
    let out = augsim(&["train", "--residual-of", "good", "--out", "net"], d);
    assert_eq!(out.status.code(), Some(2), "training data must be given");
}
