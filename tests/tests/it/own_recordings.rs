//! Contract (issue 16): one set of throws in the file layouts of many users gives one answer: the same
//! effect, with a value within the interval of the plain file. All files are read by `recognise`, as in
//! `augsim start`.

use augsim_data::{
    DataError, Dataset, MissingCells, RecognisedData, RecognitionOptions, RecordingKind, random_stream,
    read_dataset, recognise,
};
use augsim_discovery::{Estimate, Options, discover};
use augsim_physics::ball::detected_floor_m;
use augsim_physics::model::Model;
use augsim_tests::sealed::{Kind, Scene, Truth, seal};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::throws_as_files::{PLAIN, Style, write_in_twelve_layouts};

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
                     restitution = { nominal = 0.65, min = 0.0, max = 1.0 }\n[release]\nkind = \"free\"\n";

/// Twelve generated throws with quadratic drag; the only columns are x_m and z_m.
fn throws() -> Dataset {
    let scene = Scene { plane: true, at_rest: false, trajectories: 12, rate_hz: 60.0, ..Scene::DROPS };
    let truth = Truth { effects: vec![Kind::QuadraticDrag(0.08)], declared_ratio: 1.0, ..Truth::default() };
    seal(&scene, truth, &mut random_stream(17, "own recordings", 0)).expect("well formed").data
}

/// Runs the discovery on a set, asserts that it finds drag alone, and returns the estimate.
fn drag(name: &str, data: &Dataset) -> Estimate {
    let mut text = MODEL.to_owned();
    if let Some(floor) = detected_floor_m(data).filter(|z| z.abs() > 0.05) {
        text =
            text.replace("restitution", &format!("floor_height_m = {{ nominal = {floor:.4} }}\nrestitution"));
    }
    let model = Model::parse(&text, "model.toml").expect("a model");
    let d =
        discover(&model, data, &Options::default(), &mut |_| {}).unwrap_or_else(|e| panic!("{name}: {e}"));
    let kinds: Vec<&str> = d.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["quadratic-drag"], "{name}: {}", d.sentence);
    d.effects[0].parameters["k_per_m"].clone()
}

fn read(paths: &[PathBuf]) -> Result<RecognisedData, DataError> {
    recognise(paths, &RecognitionOptions::default(), MissingCells::AsGap)
}

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a writable temporary folder");
    path
}

#[test]
fn one_set_of_throws_written_in_twelve_ways_gives_one_answer() {
    let data = throws();
    let clean = drag("clean", &data);
    assert!(clean.ci95[0] <= 0.08 && 0.08 <= clean.ci95[1], "{clean}");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let d = folder.path();
    let mut slow = String::new();
    let mut same = |name: &str, read: &RecognisedData| {
        let begun = std::time::Instant::now();
        assert_eq!(read.recording, RecordingKind::Falls(2), "{name}: {:?}", read.assumptions);
        assert_eq!(read.data.trajectories().len(), 12, "{name}");
        let found = drag(name, &read.data);
        let half = 0.5 * (clean.ci95[1] - clean.ci95[0]);
        assert!(
            (found.value - clean.value).abs() < half,
            "{name}: {found}, clean {clean}: {:?}",
            read.assumptions
        );
        let _ = write!(slow, " {name} {:.1}", begun.elapsed().as_secs_f64());
    };
    let paths = write_in_twelve_layouts(&data, d);
    for (name, path) in &paths {
        let read = read(std::slice::from_ref(path)).unwrap_or_else(|e| panic!("{e}"));
        same(name, &read);
    }
    let each = &paths.last().expect("twelve").1;
    // Every command reads them as `start` does.
    assert_eq!(read_dataset(each, MissingCells::Refuse).expect("read").trajectories().len(), 12);
    eprintln!("seconds:{slow}");
}

#[test]
fn what_is_taken_for_granted_is_said_and_can_be_overridden() {
    let data = throws();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let style = Style {
        header: "shot,frame,u,v,note",
        metres: [0.01, -0.01],
        seconds: 1.0 / 60.0,
        extra: ",ok",
        ..PLAIN
    };
    let path = write(folder.path(), "image.csv", style.text(&data));
    let error = read(std::slice::from_ref(&path)).expect_err("u and v mean nothing").to_string();
    assert!(error.contains("--columns") || error.contains("--rate-hz"), "{error}");
    let reading = RecognitionOptions {
        columns: vec!["u=x_m:cm".parse().expect("a column"), "v=z_m:-0.01".parse().expect("a column")],
        rate_hz: Some(60.0),
        ..RecognitionOptions::default()
    };
    let read = recognise(&[path], &reading, MissingCells::AsGap).unwrap_or_else(|e| panic!("{e}"));
    assert!(read.assumptions.iter().any(|a| a.contains("columns not used: note")), "{:?}", read.assumptions);
    assert_eq!(read.recording, RecordingKind::Falls(2));
    for (t, clean) in read.data.trajectories().iter().zip(data.trajectories()) {
        let far = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-6);
        assert!(!far(t.column(0), clean.column(0)) && !far(t.column(1), clean.column(1)));
        assert!(!far(t.time_s(), clean.time_s()));
    }
}

#[test]
fn frame_rate_and_unit_are_told_by_the_fall() {
    let data = throws();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let style = Style { header: "run,frame,x_mm,y_mm", metres: [1e-3, -1e-3], seconds: 1.0 / 60.0, ..PLAIN };
    let read =
        read(&[write(folder.path(), "frames.csv", style.text(&data))]).unwrap_or_else(|e| panic!("{e}"));
    for part in ["free fall implies 60 Hz", "y_mm grows downwards"] {
        assert!(read.assumptions.iter().any(|a| a.contains(part)), "{part}: {:?}", read.assumptions);
    }
    let style = Style { header: "run,time,x,y", metres: [1e-3, 1e-3], ..PLAIN };
    let read = self::read(&[write(folder.path(), "unitless.csv", style.text(&data))])
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(read.assumptions.iter().any(|a| a.contains("implies mm")), "{:?}", read.assumptions);
}

#[test]
fn faults_in_a_recording_are_named_with_file_line_and_column() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refusal = |text: &str| read(&[write(folder.path(), "r.csv", text)]).expect_err("refused").to_string();
    let rows: String = (0..20).map(|k| format!("{},{},{}\n", k, 0.1 * f64::from(k), k * k)).collect();
    let error = refusal(&format!("t (s),x (m),y (m)\n{rows}20,two,3\n"));
    assert!(error.contains("line 22, column `x (m)`: `two` is not a finite number"), "{error}");
    let error = refusal(&format!("t (s),x (m),y (m)\n{rows}19,7,3\n"));
    assert!(error.contains("line 22") && error.contains("19 s follows 19 s"), "{error}");
    let error = refusal("a pendulum swung\nand it swung back\n");
    assert!(error.contains("not rows of numbers"), "{error}");
}
