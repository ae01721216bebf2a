//! Contract: `simulate --scenario push` writes consistent data, model and truth record, the same bytes
//! on any number of threads, and rejects impossible settings with exit code 2.

use crate::command::augsim;
use augsim_physics::model::{ModelFile, PushModel};

#[test]
fn writes_consistent_files_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let mut seen = Vec::new();
    for threads in ["1", "3"] {
        for protocol in ["mit", "repeat", "random"] {
            let out = format!("{threads}/{protocol}.csv.gz");
            let args = [
                "simulate",
                "--scenario",
                "push",
                "--protocol",
                protocol,
                "--trajectories",
                "4",
                "--surface",
                "plywood",
                "--object",
                "rect2",
                "--seed",
                "7",
                "--threads",
                threads,
                "--out",
                &out,
            ];
            let done = augsim(&args, d);
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
            for suffix in ["csv.gz", "model.toml", "truth.toml", "truth.csv"] {
                seen.push(std::fs::read(d.join(threads).join(format!("{protocol}.{suffix}"))).unwrap());
            }
        }
    }
    assert_eq!(seen[..12], seen[12..]);
    let data = augsim_data::read_dataset(&d.join("1/mit.csv.gz"), augsim_data::MissingCells::Refuse).unwrap();
    let names: Vec<_> = data.columns().iter().map(|c| c.name()).collect();
    assert_eq!(names, ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"]);
    assert_eq!(data.trajectories().len(), 4);
    let ModelFile::Push(PushModel { object, position_sd_m, .. }) =
        ModelFile::read(&d.join("1/mit.model.toml")).unwrap()
    else {
        panic!("a push model")
    };
    assert_eq!((object.name.as_str(), position_sd_m), ("rect2", Some(3e-4)));
    let truth: toml::Table = std::fs::read_to_string(d.join("1/mit.truth.toml")).unwrap().parse().unwrap();
    assert_eq!(truth["schema"].as_str(), Some("augsim.push-laboratory/1"));
    assert_eq!(truth["hidden"]["table_anisotropy_ratio"].as_float(), Some(1.1));
    let pushes = std::fs::read_to_string(d.join("1/mit.truth.csv")).unwrap();
    assert_eq!(pushes.lines().count(), 5);
}

#[test]
fn what_cannot_be_made_is_refused_with_exit_code_2() {
    let dir = tempfile::tempdir().unwrap();
    for (args, says) in [
        (["--object", "rekt1"], "rekt1"),
        (["--surface", "ice"], "ice"),
        (["--rate-hz", "0"], "`rate_hz` = 0 must be between 1 and 100,000 Hz"),
    ] {
        let mut all = vec!["simulate", "--scenario", "push"];
        all.extend(args);
        let done = augsim(&all, dir.path());
        let text = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{text}");
        assert!(text.contains(says), "{text}");
    }
}
