//! Contract (issue 16): for every file layout of a set of throws, `start` and then `discover` find the
//! same effect as in the clean file, with a value inside its interval.

use crate::command::succeed;
use augsim_data::{Dataset, MissingCells, Trajectory, read_dataset};
use serde_json::Value;
use std::path::Path;

/// Returns the positions of the demonstration set: 30 throws in a plane with quadratic drag.
fn throws() -> Dataset {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed/bounces.csv");
    let all = read_dataset(&path, MissingCells::Refuse).expect("a fixture");
    let positions = |t: &Trajectory| {
        Trajectory::new(t.id(), t.time_s().to_vec(), vec![t.column(0).to_vec(), t.column(1).to_vec()])
            .expect("well formed")
    };
    let trajectories = all.trajectories().iter().map(positions).collect();
    Dataset::from_names(&["x_m", "z_m"], trajectories).expect("well formed")
}

/// Returns the value and interval of the only effect that `start` and `discover` find in a file: drag in
/// 1/m.
fn drag(name: &str, file: &Path, folder: &Path) -> (f64, [f64; 2]) {
    let file = file.to_str().expect("text");
    succeed(&["start", file, "--out", "begun", "--force"], folder);
    succeed(&["discover", "begun/model.toml", "begun/data.csv", "--out", "found", "--force"], folder);
    let text = std::fs::read_to_string(folder.join("found/result.json")).expect("written");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(result["verdict"], "explained", "{name}");
    let effects = result["effects"].as_array().expect("effects");
    assert_eq!(effects.len(), 1, "{name}: {effects:?}");
    assert_eq!(effects[0]["kind"], "quadratic-drag", "{name}");
    let k = &effects[0]["parameters"]["k_per_m"];
    let number = |v: &Value| v.as_f64().expect("a number");
    (number(&k["value"]), [number(&k["ci95"][0]), number(&k["ci95"][1])])
}

#[test]
fn finds_the_same_effect_in_every_file_layout() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let d = folder.path();
    let data = throws();
    let clean = d.join("clean.csv");
    std::fs::write(&clean, crate::throws_as_files::PLAIN.text(&data)).expect("written");
    let (value, ci95) = drag("clean", &clean, d);
    // The true value of the fixture is 0.031 1/m.
    assert!(ci95[0] <= 0.031 && 0.031 <= ci95[1], "{value} {ci95:?}");
    for (name, file) in crate::throws_as_files::write_in_twelve_layouts(&data, d) {
        let (found, _) = drag(name, &file, d);
        assert!(ci95[0] < found && found < ci95[1], "{name}: {found}, clean {value} {ci95:?}");
    }
}
