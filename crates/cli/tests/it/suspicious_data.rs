//! Contract: impossible data end a command with one sentence, exit code 3 and no output; suspicious data
//! give a warning on standard error, in `result.json` and on the page, and copies are skipped;
//! `--accept` disables a check; `data inspect` lists every check with its outcome.
//!
//! The data are the demonstration set and generated drops with typical user errors.

use crate::command::augsim;
use std::path::{Path, PathBuf};
use std::process::Output;

fn errors(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

/// Returns the path of a file of the demonstration set.
fn sealed(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed").join(name)
}

/// Returns the CSV text of the demonstration data set, with `change` applied to the cells of each row.
fn bounces(change: impl Fn(&mut Vec<String>)) -> String {
    let text = std::fs::read_to_string(sealed("bounces.csv")).expect("a fixture");
    let mut lines = text.lines();
    let mut out = format!("{}\n", lines.next().expect("a header"));
    for line in lines {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(&mut cells);
        out += &(cells.join(",") + "\n");
    }
    out
}

/// Makes a folder with the demonstration model file and a file `bounces.csv` with the content `text`.
fn folder(text: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::fs::copy(sealed("model.toml"), dir.path().join("model.toml")).expect("copied");
    std::fs::write(dir.path().join("bounces.csv"), text).expect("written");
    dir
}

/// Function that changes a sample: from (height, velocity) to (height, velocity).
type Change<'a> = &'a dyn Fn(f64, f64) -> (f64, f64);

const DISCOVER: [&str; 6] = ["discover", "model.toml", "bounces.csv", "--out", "found", "-q"];

#[test]
fn discover_rejects_impossible_data_without_output() {
    let dir = folder(&bounces(|cells| {
        if cells[1] == "0.25" {
            cells[3] = "9999".to_owned();
        }
    }));
    let out = augsim(&DISCOVER, dir.path());
    let error = errors(&out);
    assert_eq!(out.status.code(), Some(3), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    for part in ["bounces.csv", "`z_m` holds 9999", "outlier", "--accept sentinel-value"] {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
    assert!(!dir.path().join("found").exists());
}

#[test]
fn rejects_a_declared_noise_of_two_metres() {
    let dir = folder(&bounces(|_| ()));
    let model = std::fs::read_to_string(sealed("model.toml")).expect("a fixture");
    let metres = model.replace("position_sd_m = 0.00204", "position_sd_m = 2.04");
    assert_ne!(metres, model);
    std::fs::write(dir.path().join("model.toml"), metres).expect("written");
    let out = augsim(&DISCOVER, dir.path());
    assert_eq!(out.status.code(), Some(3));
    assert!(errors(&out).contains("`position_sd_m` = 2.04"), "{}", errors(&out));
}

#[test]
fn skips_and_reports_copies_unless_accepted() {
    let whole = bounces(|_| ());
    let copy =
        whole.lines().filter_map(|l| l.strip_prefix("3,")).fold(String::new(), |t, l| t + "copy," + l + "\n");
    let dir = folder(&(whole.clone() + &copy));
    let out = augsim(&DISCOVER, dir.path());
    assert_eq!(out.status.code(), Some(0), "{}", errors(&out));
    let said = "trajectory `copy` repeats `3`";
    assert!(errors(&out).contains("warning (repeated-trajectory)") && errors(&out).contains(said));
    let read = |name: &str| std::fs::read_to_string(dir.path().join("found").join(name)).expect("written");
    let result: serde_json::Value = serde_json::from_str(&read("result.json")).expect("JSON");
    assert_eq!(result["warnings"][0]["check"], "repeated-trajectory");
    assert!(
        read("report.html").contains("Warnings about the data") && read("report.html").contains("repeats")
    );

    // Without the copy there are no findings and no warnings.
    let plain = folder(&whole);
    let out = augsim(&DISCOVER, plain.path());
    assert_eq!(errors(&out), "");
    let text = std::fs::read_to_string(plain.path().join("found/result.json")).expect("written");
    let clean: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(clean["effects"], result["effects"], "the copy changes no number");
    assert!(clean.get("warnings").is_none());
}

#[test]
fn train_rejects_data_that_contradict_its_physics() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let out =
        augsim(&["simulate", "--trajectories", "6", "--samples", "80", "--out", "drops.csv"], dir.path());
    assert_eq!(out.status.code(), Some(0), "{}", errors(&out));
    let text = std::fs::read_to_string(dir.path().join("drops.csv")).expect("written");
    let with = |change: Change<'_>| {
        let mut lines = text.lines();
        let mut all = format!("{}\n", lines.next().expect("a header"));
        for line in lines {
            let c: Vec<&str> = line.split(',').collect();
            let (z, v) = change(c[2].parse().expect("a number"), c[3].parse().expect("a number"));
            all += &format!("{},{},{z:?},{v:?}\n", c[0], c[1]);
        }
        all
    };
    let cases: [(&str, Change<'_>); 7] = [
        ("gravity-disagrees", &|z, v| (1e3 * z, 1e3 * v)),
        ("gravity-disagrees", &|z, v| (-z, -v)),
        ("velocity-disagrees", &|z, v| (v, z)),
        ("velocity-disagrees", &|z, v| (1e3 * z, v)),
        ("constant-column", &|_, v| (4.5, v)),
        ("constant-column", &|z, _| (z, 0.5)),
        ("absurd-value", &|z, v| (1e30 * z, 1e30 * v)),
    ];
    let train = |extra: &[&str]| {
        let args =
            ["train", "--pybullet-ball", "--data", "bad.csv", "--out", "run", "--iterations", "2", "-q"];
        augsim(&[&args, extra].concat(), dir.path())
    };
    for (check, change) in cases {
        std::fs::write(dir.path().join("bad.csv"), with(change)).expect("written");
        let out = train(&[]);
        assert_eq!(out.status.code(), Some(3), "{check}: {}", errors(&out));
        assert!(errors(&out).contains(&format!("bad.csv: suspicious data ({check})")), "{}", errors(&out));
        assert!(!dir.path().join("run/config.resolved.toml").exists());
    }
    // Other gravity is valid for a network without physics and with `--accept`, which the run stores.
    std::fs::write(dir.path().join("bad.csv"), with(cases[1].1)).expect("written");
    let neural = train(&["--recipe", "neural"]);
    assert_eq!(neural.status.code(), Some(0), "{}", errors(&neural));
    std::fs::remove_dir_all(dir.path().join("run")).expect("removed");
    let accepted = train(&["--accept", "gravity-disagrees"]);
    assert_eq!(accepted.status.code(), Some(0), "{}", errors(&accepted));
    let config = std::fs::read_to_string(dir.path().join("run/config.resolved.toml")).expect("written");
    assert!(config.contains("accept = [\"gravity-disagrees\"]"), "{config}");
}

#[test]
fn inspect_lists_every_check_with_its_outcome() {
    let dir = folder(&bounces(|cells| {
        cells[2] = format!("{}", 100.0 * cells[2].parse::<f64>().expect("a number"))
    }));
    let out = augsim(&["data", "inspect", "bounces.csv"], dir.path());
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert_eq!(out.status.code(), Some(0));
    let line =
        |name: &str| text.lines().find(|l| l.trim_start().starts_with(name)).expect("listed").to_owned();
    assert!(
        line("repeated-trajectory").contains("passed") && line("column-scale").contains("refused"),
        "{text}"
    );
    assert!(line("gravity-disagrees").contains("needs --model"), "{text}");
    let out = augsim(&["data", "inspect", "bounces.csv", "--model", "model.toml", "--json"], dir.path());
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    let checks = json["checks"].as_array().expect("a list");
    assert_eq!((checks.len(), &checks[11]["outcome"]), (15, &"passed".into()), "{json}");
    assert_eq!(json["trajectories"], 30);
}

#[test]
fn an_unknown_check_is_a_usage_error_with_a_list_of_checks() {
    let dir = folder(&bounces(|_| ()));
    let out = augsim(&[&DISCOVER[..], &["--accept", "everything"]].concat(), dir.path());
    assert_eq!(out.status.code(), Some(2));
    assert!(errors(&out).contains("repeated-trajectory") && errors(&out).contains("declared-noise"));
}

const TANKS: &str = r#"scenario = "system"
name = "two tanks"
[inputs]
pump_V = { hold = "zero" }
[states]
upper_m = { start = "high_m", min = 0.0 }
lower_m = { start = "low_m", min = 0.0 }
[parameters]
upper_per_s = { nominal = 0.05, min = 0.0, max = 1.0 }
lower_per_s = { nominal = 0.02, min = 0.0, max = 1.0 }
gain_m_per_V_s = { nominal = 0.003, min = 0.0, max = 1.0 }
[rates]
upper_m = "gain_m_per_V_s * pump_V - upper_per_s * upper_m"
lower_m = "upper_per_s * upper_m - lower_per_s * lower_m"
[outputs]
high_m = { value = "upper_m", sd = "estimate" }
low_m = { value = "lower_m", sd = "estimate" }
"#;

/// Makes a folder with recordings of two tank levels, in which `change` alters (time, level, level) of each row.
fn tanks(change: &dyn Fn(usize, &mut [f64; 3])) -> tempfile::TempDir {
    let mut text = "trajectory,t_s,pump_V,high_m,low_m\n".to_owned();
    for j in 0..8 {
        let (mut upper, mut lower) = (0.1 + 0.02 * j as f64, 0.3);
        for k in 0..100 {
            let pump = [1.0, 3.0, 2.0, 4.0, 0.5][(k / 20 + j) % 5];
            let mut row = [2.0 * k as f64, upper, lower];
            change(j, &mut row);
            text += &format!("r{j},{:.6},{pump},{:.6},{:.6}\n", row[0], row[1], row[2]);
            upper += 2.0 * (0.003 * pump - 0.05 * upper);
            lower += 2.0 * (0.05 * upper - 0.02 * lower);
        }
    }
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(dir.path().join("bounces.csv"), text).expect("written");
    std::fs::write(dir.path().join("model.toml"), TANKS).expect("written");
    dir
}

#[test]
fn reports_logger_errors_before_fitting_equations() {
    for (check, said, change) in [
        (
            "mixed-clock",
            "trajectory `r3`: its time step is 2000 s",
            &(|j: usize, row: &mut [f64; 3]| row[0] *= if j == 3 { 1e3 } else { 1.0 })
                as &dyn Fn(usize, &mut [f64; 3]),
        ),
        ("duplicate-column", "columns `high_m` and `low_m`, both outputs", &|_, row| row[2] = row[1]),
    ] {
        let dir = tanks(change);
        let out = augsim(&DISCOVER, dir.path());
        assert_eq!(out.status.code(), Some(3), "{}", errors(&out));
        assert!(
            errors(&out).contains(&format!("bounces.csv: suspicious data ({check}): {said}")),
            "{}",
            errors(&out)
        );
        assert!(!dir.path().join("found").exists());
        let out = augsim(&["data", "inspect", "bounces.csv", "--model", "model.toml"], dir.path());
        assert!(
            String::from_utf8_lossy(&out.stdout).contains(said),
            "{}",
            String::from_utf8_lossy(&out.stdout)
        );
    }
    let dir = tanks(&|_, _| ());
    let out = augsim(&["data", "inspect", "bounces.csv"], dir.path());
    assert!(
        !String::from_utf8_lossy(&out.stdout).contains("refused"),
        "{}",
        String::from_utf8_lossy(&out.stdout)
    );
}
