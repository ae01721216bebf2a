//! Contract: `reproduce push` on published files makes its tables from them and says so, gives the same
//! bytes on any number of threads, and can be resumed; a folder without push files is an error with a
//! remedy. The virtual laboratory writes the files in the published JSON layout: 30 pushes on ABS, 8 on
//! plywood.

use crate::command::augsim;
use augsim_physics::push::Object;
use augsim_physics::push::laboratory::{PushDesign, PushRecipe, SupportSheet};
use std::fmt::Write as _;
use std::path::Path;

/// Writes pushes in the published JSON layout: three streams of rows `[time, a, b, c]`.
fn publish(folder: &Path, surface: &str, count: usize) {
    let object = Object::named("rect1").expect("built in");
    let sheet = SupportSheet::named(surface).expect("known");
    let made = PushRecipe::new(PushDesign::Mit, &object, sheet, count).generate(4).expect("it can be made");
    let folder = folder.join(surface).join("rect1");
    std::fs::create_dir_all(&folder).expect("a folder");
    for (i, t) in made.data.trajectories().iter().enumerate() {
        let rows = |columns: [Option<usize>; 3]| {
            let mut out = String::new();
            for k in 0..t.len() {
                let value = |c: Option<usize>| c.map_or(0.0, |c| t.column(c)[k]);
                let [a, b, c] = columns.map(value);
                let comma = if k == 0 { "" } else { "," };
                let _ = write!(out, "{comma}[{},{a},{b},{c}]", 1e9 + t.time_s()[k]);
            }
            out
        };
        let text = format!(
            "{{\"tip_pose\":[{}],\"object_pose\":[{}],\"ft_wrench\":[{}]}}",
            rows([Some(0), Some(1), None]),
            rows([Some(2), Some(3), Some(4)]),
            rows([None; 3])
        );
        let name =
            format!("motion_surface={surface}_shape=rect1_a=0_v=20_i=0.000_s=0.500_t=0.000_rep={i:04}.json");
        std::fs::write(folder.join(name), text).expect("a file");
    }
}

#[test]
fn makes_tables_from_published_files_and_resumes() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    publish(&dir.path().join("mit"), "abs", 30);
    publish(&dir.path().join("mit"), "plywood", 8);
    let run = |out: &str, more: &[&str]| {
        let args = ["reproduce", "push", "--data", "mit", "--iterations", "8", "--seed", "3", "--out", out];
        let output = augsim(&[&args[..], more].concat(), dir.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let result = std::fs::read(dir.path().join(out).join("result.json")).expect("a result");
        let weights = std::fs::read(dir.path().join(out).join("hybrid-plus-27/weights.safetensors"));
        (
            result,
            weights.expect("27 of 30 pushes are trained on"),
            String::from_utf8_lossy(&output.stdout).into_owned(),
        )
    };
    let one = run("one", &["--threads", "1"]);
    let three = run("three", &["--threads", "3"]);
    assert!(one.0 == three.0 && one.1 == three.1, "threads change the result");
    let again = run("one", &["--resume"]);
    assert!(again.0 == one.0 && again.1 == one.1, "going on changes a finished result");
    let text = String::from_utf8_lossy(&one.0);
    for expected in [
        "\"scenario\": \"push\"",
        "\"schema\": \"augsim.reproduce/1\"",
        "published MIT Push files",
        "unseen surface",
        "pos_mm",
    ] {
        assert!(text.contains(expected), "`{expected}` is not in the result");
    }
    assert!(!text.contains("virtual laboratory"), "the table must say where its pushes come from");
    for model in ["Zero", "Still", "Physics", "GP", "Neural", "Neural+", "Hybrid", "Hybrid+"] {
        assert!(text.contains(&format!("\"model\": \"{model}\"")), "no row of {model}");
    }
    assert!(one.2.contains("test: rect1 on abs, 3 pushes"), "{}", one.2);
    let page = std::fs::read_to_string(dir.path().join("one/report.html")).expect("a report");
    assert!(page.contains("Learning curves") && !page.contains("<script"));
}

#[test]
fn one_network_gives_its_rows_and_its_point_of_the_curve() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    publish(&dir.path().join("mit"), "abs", 30);
    publish(&dir.path().join("mit"), "plywood", 8);
    let run = |out: &str, more: &[&str]| {
        let args = ["reproduce", "push", "--data", "mit", "--iterations", "8", "--seed", "3", "--out", out];
        augsim(&[&args[..], more].concat(), dir.path())
    };
    let result = |out: &str| -> serde_json::Value {
        let text = std::fs::read_to_string(dir.path().join(out).join("result.json")).expect("a result");
        serde_json::from_str(&text).expect("JSON")
    };
    let rows = |result: &serde_json::Value| -> Vec<serde_json::Value> {
        let rows = result["rows"].as_array().expect("rows").iter();
        rows.filter(|row| row["model"] == "Hybrid+").cloned().collect()
    };
    for (out, more) in [("all", &[][..]), ("alone", &["--net", "hybrid-plus"])] {
        let ended = run(out, more);
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    }
    let alone = result("alone");
    assert_eq!(alone["rows"].as_array().map(Vec::len), Some(2), "the test pushes and the other support");
    assert_eq!(rows(&alone), rows(&result("all")));
    let few = ["--net", "hybrid-plus", "--train-size", "10"];
    assert!(run("few", &few).status.success());
    let few = result("few");
    assert!(few["curve"][0]["train_pushes"] == 10 && rows(&few) != rows(&alone));
    let refused = run("many", &["--net", "hybrid-plus", "--train-size", "28"]);
    let error = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && error.contains("there are 27 training pushes"), "{error}");
}

#[test]
fn rejects_a_folder_without_pushes_with_a_remedy() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::fs::create_dir(dir.path().join("empty")).expect("a folder");
    for folder in ["empty", "absent"] {
        let out = augsim(&["reproduce", "push", "--data", folder, "--out", "out"], dir.path());
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(3), "{error}");
        assert!(error.contains(folder) && error.contains("omit --data"), "{error}");
        assert!(!dir.path().join("out").exists());
    }
}

#[test]
fn names_a_truncated_published_file() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let folder = dir.path().join("mit/abs/rect1");
    std::fs::create_dir_all(&folder).expect("a folder");
    let name = "motion_surface=abs_shape=rect1_a=0_v=20_i=0.000_s=0.500_t=0.000.json";
    std::fs::write(folder.join(name), "{\"tip_pose\":[[1,2,").expect("a file");
    let out = augsim(&["reproduce", "push", "--data", "mit", "--out", "out"], dir.path());
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(3), "{error}");
    assert!(error.contains(name) && !error.contains("panicked"), "{error}");
}
