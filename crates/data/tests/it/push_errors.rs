//! Contract: for every fault of a push file, a set of them or an NPZ file there is an error that states the
//! file (`F`), the stream and the remedy. The texts of this crate are asserted word for word.

use augsim_data::convert::CONVERTERS;
use augsim_data::push::{PushTrial, TrialName, read_push_trials};
use augsim_data::{MissingCells, read_dataset};
use npyz::WriterBuilder;
use std::path::{Path, PathBuf};

const NAME: &str = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000";

fn hdf5() -> Vec<u8> {
    std::fs::read(crate::shared_data::workspace().join(format!("fixtures/mit-push/{NAME}.h5")))
        .expect("a fixture")
}

fn refusal(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().expect("a writable temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a writable temporary folder");
    let error = PushTrial::read(&path).and_then(|t| t.trajectory()).expect_err("the file is faulty");
    error.to_string().replace(&path.display().to_string(), "F")
}

fn json(tip: &str, object: &str, wrench: &str) -> String {
    let text = format!(r#"{{"tip_pose": {tip}, "object_pose": {object}, "ft_wrench": {wrench}}}"#);
    refusal("block=steel_run=01.json", text.as_bytes())
}

const GOOD: &str = "[[0, 0, 0, 0], [1, 0, 0, 0]]";

#[test]
fn truncated_hdf5_is_an_error() {
    let whole = hdf5();
    let name = format!("{NAME}.h5");
    let error = refusal(&name, &whole[..whole.len() / 2]);
    assert!(error.starts_with("F: `tip_pose`: the HDF5 file is damaged or cut off ("), "{error}");
    assert!(error.ends_with("; copy or download it again"), "{error}");
    // Every truncation gives an error and no panic.
    for end in (9..whole.len()).step_by(97) {
        let error = refusal(&name, &whole[..end]);
        assert!(error.starts_with("F: `") && error.contains("cut off"), "{end}: {error}");
    }
}

#[test]
fn flipped_bytes_never_panic() {
    let whole = hdf5();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("{NAME}.h5"));
    // The metadata of the file are in its first 2 kB.
    for offset in 8..2048 {
        let mut bytes = whole.clone();
        bytes[offset] ^= 0x5a;
        std::fs::write(&path, bytes).unwrap();
        // A flip in a time stamp or in padding may still read; only a panic fails.
        let _ = PushTrial::read(&path);
    }
}

#[test]
fn missing_streams_and_other_layouts_are_errors() {
    assert_eq!(
        refusal("block=steel_run=01.json", br#"{"tip_pose": [], "ft_wrench": []}"#),
        "F: stream `object_pose` is missing; the file has: ft_wrench, tip_pose; a trial needs tip_pose, \
         object_pose and ft_wrench: copy or download the file again, or remove it"
    );
    assert_eq!(
        json("[[0, 1]]", GOOD, GOOD),
        "F: stream `tip_pose` has 2 numbers in row 0; store it as rows of four numbers: time and three values"
    );
    assert!(json("\"none\"", GOOD, GOOD).starts_with("F: stream `tip_pose` is not rows of numbers"));
    assert_eq!(
        json(GOOD, "[[0, 0, 0, 0]]", GOOD),
        "F: stream `object_pose` has fewer than two samples at different times; remove the trial"
    );
    assert_eq!(
        json(GOOD, GOOD, "[[5, 0, 0, 0], [6, 0, 0, 0]]"),
        "F: tip_pose, object_pose and ft_wrench do not overlap in time; check that their clocks are the same, or \
         remove the trial"
    );
    let cut = br#"{"tip_pose": [[0, 0, 0, 0], [1, 0"#;
    assert!(refusal("block=al_run=01.json", cut).starts_with("F: not valid JSON (EOF while parsing"));
    assert_eq!(
        refusal("block=al_run=01.json", b"hello"),
        "F: the content is neither HDF5, JSON nor a zip archive of them; copy or download the file again"
    );
}

#[test]
fn values_that_are_not_numbers_and_decreasing_times_are_errors() {
    let refused = "F: stream `object_pose`, row 1: a value is not a finite number; remove the row";
    for value in ["NaN", "-Infinity", "null"] {
        assert_eq!(json(GOOD, &format!("[[0, 0, 0, 0],\n [1, 0, {value}, 0]]"), GOOD), refused, "{value}");
    }
    assert_eq!(
        json("[[0, 0, 0, 0], [2, 0, 0, 0], [1, 0, 0, 0]]", GOOD, GOOD),
        "F: stream `tip_pose`, row 2: the time decreases (1 s follows 2 s); sort the rows by time, or remove the trial \
         if its clock was reset"
    );
}

#[test]
fn file_names_without_the_pattern_are_errors() {
    let text = |name: &str| TrialName::parse(Path::new(name)).unwrap_err().to_string();
    assert_eq!(
        text(&NAME.replace("abs", "marble")),
        format!(
            "{}: file name: unknown surface `marble`; known values are abs, delrin, plywood, pu; correct the name or \
             remove the file",
            NAME.replace("abs", "marble")
        )
    );
    assert!(
        text(&NAME.replace("tri1", "tri4"))
            .contains("unknown shape `tri4`; known values are rect1, rect2, rect3")
    );
    assert!(text("block=gold_run=01").contains("unknown block `gold`; known values are steel, al, plastic"));
    assert!(text(&NAME.replace("i=1.000", "i=3.000")).contains("`i=3.000` is not between 0 and 2"));
    assert!(text(&NAME.replace("_v=20", "")).contains("where `v=` is expected"));
    assert!(text(&NAME.replace("a=0", "a=x")).contains("`a=x` is not a valid number"));
    assert!(text("drops.json").contains("`block=` is expected"));
    assert!(text("drops.json").contains("rename the file or remove it"));
}

#[test]
fn repeated_trials_and_folders_without_trials_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let error = read_push_trials(folder.path()).unwrap_err().to_string();
    assert!(error.contains("there are no push files; expected `.h5`, `.json` or `.zip` files"), "{error}");
    for inner in ["h5", "json"] {
        std::fs::create_dir(folder.path().join(inner)).unwrap();
        std::fs::write(folder.path().join(inner).join(format!("{NAME}.h5")), hdf5()).unwrap();
    }
    let error = read_push_trials(folder.path()).unwrap_err().to_string();
    assert!(
        error.contains("the same trial is also in") && error.contains("convert only one of them"),
        "{error}"
    );
}

/// Archive members whose names are too long or have control characters are refused, because messages show names.
#[test]
fn a_member_whose_name_cannot_be_printed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pushes.zip");
    for name in ["abs/\u{1b}[31m.json".to_owned(), format!("abs/{}.json", "x".repeat(300))] {
        let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.finish().unwrap();
        let error = read_push_trials(&path).unwrap_err().to_string();
        assert!(error.ends_with("is too long or contains control characters; rename it"), "{error}");
        assert!(!error.contains('\u{1b}') && error.len() < 400, "{error}");
    }
}

/// Message of the error with which the converter of the data set `set` refuses a path.
fn conversion(set: &str, path: &Path) -> String {
    let (_, convert) = CONVERTERS.iter().find(|(name, _)| *name == set).expect("a converter");
    convert(path).expect_err("faulty").to_string().replace(&path.display().to_string(), "F")
}

#[test]
fn faulty_runs_and_logs_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("run.csv");
    let header = "t_s,pusher_x_m,pusher_y_m,slider_x_m,slider_y_m,slider_th_rad,pusher_new,slider_new\n";
    std::fs::write(&path, format!("{header}1,0,0,0,0,0,1,1\n0.9,0,0,0,0,0,1,1\n")).unwrap();
    assert_eq!(
        conversion("mit-pusher-slider", &path),
        "F: line 3, column `t_s`: the time of trajectory `run` does not increase (0.9 s follows 1 s); sort its rows by \
         time and remove repeated times"
    );
    std::fs::write(&path, "t_s,pusher_x_m\n").unwrap();
    assert!(conversion("mit-pusher-slider", &path).contains("column `pusher_new` is missing"));
    std::fs::write(folder.path().join("index.csv"), "file,perturbations\nruns/a.csv,none\n").unwrap();
    assert!(
        conversion("mit-pusher-slider", folder.path())
            .ends_with("index.csv: the listed file `runs/a.csv` is missing; restore it or remove its row")
    );
    std::fs::write(&path, "1\n1 2 3 1 0 0 0\n1 2 3 1 0 0 0\n2\n0 0 0\n").unwrap();
    assert_eq!(
        conversion("cmu-mlab", &path),
        "F: line 6: expected a force sample of three numbers; the log is damaged or cut off: copy or download it \
         again"
    );
    assert!(conversion("cmu-mlab", folder.path()).contains("expected `sensor_log/*.txt`"));
}

#[test]
fn npz_without_a_required_array_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drops.npz");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    archive.start_file("t_s.npy", zip::write::SimpleFileOptions::default()).unwrap();
    npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[2])
        .writer(&mut archive)
        .begin_nd()
        .and_then(|mut w: npyz::NpyWriter<f64, _>| w.extend([0.0, 1.0]).and_then(|()| w.finish()))
        .unwrap();
    archive.finish().unwrap();
    let error = read_dataset(&path, MissingCells::Refuse).unwrap_err().to_string();
    assert!(error.contains("array `trajectory`: is missing; the file has: t_s"), "{error}");
}
