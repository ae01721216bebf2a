//! Contract: a network learns the residual of a model of equations on estimated states, and forecasts
//! from the first samples only. The data are those of an oscillator that the test integrates. If its
//! equation lacks an effect, the network has a smaller error than the physics with correct coverage;
//! otherwise it does not increase the error. Later samples do not change a forecast. Unsuitable data
//! give one sentence.

use crate::command::{fail, succeed};
use std::fmt::Write as _;
use std::path::Path;

fn refused(args: &[&str], code: i32, dir: &Path) -> String {
    fail(code, args, dir, &[])
}

const MODEL: &str = "scenario = \"system\"\nname = \"oscillator\"\n[inputs]\nforce_N = { hold = \"zero\" }\n[states]\n\
    x_m = { start = \"position_m\" }\nv_m_s = { start = \"slope(position_m)\" }\n[parameters]\n\
    stiffness_N_per_m = { nominal = 40.0 }\ndamping_N_s_per_m = { nominal = 0.4 }\n\
    mass_kg = { nominal = 1.0, frozen = true }\n[rates]\nx_m = \"v_m_s\"\n\
    v_m_s = \"(force_N - stiffness_N_per_m * x_m - damping_N_s_per_m * v_m_s) / mass_kg\"\n[outputs]\n\
    position_m = { value = \"x_m\", sd = \"estimate\" }\n";

/// Generator of random numbers in [-1, 1) from a counter (splitmix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() / 2.0
    }
}

/// Writes positions of an oscillator with the additional force `force`, every 10 ms with 1 mm noise.
fn oscillate(file: &Path, force: fn(f64, f64) -> f64, records: usize, samples: usize, seed: u64) {
    let mut n = Numbers(seed);
    let mut text = "trajectory,t_s,force_N,position_m\n".to_owned();
    for record in 0..records {
        let (mut x, mut v) = (0.4 * n.next(), n.next());
        let mut push = 0.0;
        for k in 0..samples {
            if k % 12 == 0 {
                push = 12.0 * n.next();
            }
            let read = x + 1e-3 * n.normal();
            writeln!(text, "{record},{:.2},{push:.6},{read:.6}", 0.01 * k as f64).expect("a string takes it");
            // Leapfrog with 20 steps per sample and the damping at the midpoint.
            for _ in 0..20 {
                let h = 0.01 / 20.0;
                x += 0.5 * h * v;
                let middle = v + 0.5 * h * (push - 40.0 * x - 0.4 * v + force(x, v));
                v += h * (push - 40.0 * x - 0.4 * middle + force(x, middle));
                x += 0.5 * h * v;
            }
        }
    }
    std::fs::write(file, text).expect("it can be written");
}

fn none(_: f64, _: f64) -> f64 {
    0.0
}

/// Force that the model lacks: a hardening spring and dry friction.
fn lacking(x: f64, v: f64) -> f64 {
    -60.0 * x.powi(3) - 1.5 * (v / 0.1).tanh()
}

/// Makes a folder with the model, `records` training and four test recordings of the oscillator with an
/// additional force.
fn scene(force: fn(f64, f64) -> f64, records: usize, samples: usize) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    std::fs::write(d.join("model.toml"), MODEL).expect("it can be written");
    oscillate(&d.join("train.csv"), force, records, samples, 1);
    oscillate(&d.join("test.csv"), force, 4, samples, 2);
    dir
}

fn train(d: &Path, iterations: &str, more: &[&str]) {
    let args =
        ["train", "--model", "model.toml", "--data", "train.csv", "--iterations", iterations, "--out", "run"];
    succeed(&[&args[..], more].concat(), d);
}

/// Returns the scores of the physics and of the network on the test data.
fn scores(d: &Path) -> [serde_json::Value; 2] {
    let args = ["evaluate", "run", "--data", "test.csv", "--burn-in", "10", "--json"];
    let told: serde_json::Value = serde_json::from_str(&succeed(&args, d)).expect("JSON");
    let row = |k: usize| told["rows"][k].clone();
    assert_eq!(row(0)["model"], "Physics", "{told}");
    assert_eq!((row(1)["output"].as_str(), row(1)["unit"].as_str()), (Some("position_m"), Some("m")));
    [row(0), row(1)]
}

fn number(row: &serde_json::Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no {key} in {row}"))
}

#[test]
fn a_network_learns_a_missing_effect() {
    let dir = scene(lacking, 8, 400);
    // Coverage is correct on average over motions of different difficulty, so four recordings are not
    // enough to test it.
    oscillate(&dir.path().join("test.csv"), lacking, 16, 400, 11);
    train(dir.path(), "800", &[]);
    let [physics, net] = scores(dir.path());
    for key in ["rmse", "crps"] {
        assert!(number(&net, key) < 0.5 * number(&physics, key), "{physics} {net}");
    }
    let inside = number(&net, "coverage90");
    assert!((0.75..=0.98).contains(&inside), "{net}");
}

#[test]
fn a_network_does_not_worsen_a_complete_model() {
    let dir = scene(none, 8, 400);
    train(dir.path(), "200", &[]);
    let [physics, net] = scores(dir.path());
    assert!(number(&net, "rmse") < 1.05 * number(&physics, "rmse"), "{physics} {net}");
    assert!(number(&net, "crps") < 1.1 * number(&physics, "crps"), "{physics} {net}");
}

#[test]
fn a_forecast_uses_only_the_first_samples_and_the_inputs() {
    let dir = scene(lacking, 3, 120);
    let d = dir.path();
    train(d, "20", &[]);
    let forecast = |data: &str| {
        let args =
            ["predict", "run", "--data", data, "--burn-in", "10", "--samples", "8", "--out", "forecast.csv"];
        succeed(&args, d);
        std::fs::read_to_string(d.join("forecast.csv")).expect("a forecast")
    };
    let before = forecast("test.csv");
    assert_eq!(before.lines().count(), 1 + 4 * 120);
    let text = std::fs::read_to_string(d.join("test.csv")).expect("data");
    let changed = |(k, line): (usize, &str)| match (k, line.rsplit_once(',')) {
        (k, Some((rest, _))) if k > 0 && (k - 1) % 120 >= 10 => format!("{rest},7.5\n"),
        _ => format!("{line}\n"),
    };
    std::fs::write(d.join("later.csv"), text.lines().enumerate().map(changed).collect::<String>())
        .expect("written");
    assert_eq!(forecast("later.csv"), before);
    let first = text.replacen("0,0.00,", "0,0.00,1", 1);
    std::fs::write(d.join("first.csv"), first).expect("written");
    assert_ne!(forecast("first.csv"), before, "the inputs are seen");
}

#[test]
fn resumes_bit_for_bit_and_trains_every_rate_recipe() {
    let dir = scene(lacking, 3, 120);
    let d = dir.path();
    train(d, "12", &[]);
    let weights = || std::fs::read(d.join("run/weights.safetensors")).expect("weights");
    let (once, checkpoint) = (weights(), std::fs::read(d.join("run/checkpoint.bin")).expect("a checkpoint"));
    succeed(&["train", "--resume", "--out", "run"], d);
    assert_eq!(
        (weights(), std::fs::read(d.join("run/checkpoint.bin")).expect("a checkpoint")),
        (once, checkpoint)
    );
    for recipe in ["feed-forward-residual", "recurrent-residual", "mixture-residual", "ensemble-residual"] {
        train(d, "12", &["--recipe", recipe, "--force"]);
        let [physics, net] = scores(d);
        assert!(number(&net, "rmse").is_finite() && physics["model"] != net["model"], "{recipe}: {net}");
    }
}

#[test]
fn rejects_unsuitable_data_with_one_sentence() {
    let dir = scene(none, 3, 120);
    let d = dir.path();
    let train = |data: &str, more: &[&str], code: i32| {
        let args = ["train", "--model", "model.toml", "--data", data, "--iterations", "5", "--out", "new"];
        let text = refused(&[&args[..], more].concat(), code, d);
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(!d.join("new/checkpoint.bin").exists());
        text
    };
    let text = train("train.csv", &["--recipe", "hybrid"], 2);
    assert!(text.contains("does not correct rates of equations") && text.contains("hybrid-plus"), "{text}");
    let all = std::fs::read_to_string(d.join("train.csv")).expect("data");
    std::fs::write(
        d.join("gap.csv"),
        all.lines().filter(|l| !l.starts_with("2,0.50,")).fold(String::new(), |t, l| t + l + "\n"),
    )
    .expect("written");
    let text = train("gap.csv", &[], 3);
    assert!(
        text.contains("trajectory `2`: the step at 0.49 s is 0.02 s")
            && text.contains("constant sampling step"),
        "{text}"
    );
    std::fs::write(d.join("blind.csv"), all.replacen("force_N", "forces_N", 1)).expect("written");
    let text = train("blind.csv", &[], 3);
    assert!(text.contains("no column `force_N`, an input of model.toml"), "{text}");

    self::train(d, "5", &[]);
    let slow = all
        .lines()
        .enumerate()
        .filter(|(k, _)| k % 2 == 1 || *k == 0)
        .fold(String::new(), |t, (_, l)| t + l + "\n");
    std::fs::write(d.join("slow.csv"), slow).expect("written");
    let text = refused(&["evaluate", "run", "--data", "slow.csv"], 3, d);
    assert!(text.contains("trained on steps of 0.01 s"), "{text}");
    let text = refused(&["evaluate", "run", "--data", "test.csv", "--protocol", "reconstruction"], 2, d);
    assert!(text.contains("only forecast"), "{text}");
    let text = refused(&["predict", "run", "--data", "test.csv", "--seen", "20", "--out", "seen.csv"], 2, d);
    assert!(text.contains("--burn-in"), "{text}");
}
