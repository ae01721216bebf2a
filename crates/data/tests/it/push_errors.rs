//! Contract: whatever is wrong with a push file, a set of them or an NPZ file, there is one error that names the
//! file (`F`), the stream and the remedy, word for word as below where the words are ours.

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
fn hdf5_that_was_cut_off_anywhere_is_refused() {
    let whole = hdf5();
    let name = format!("{NAME}.h5");
    let error = refusal(&name, &whole[..whole.len() / 2]);
    assert!(error.starts_with("F: `tip_pose`: the HDF5 file is damaged or cut off ("), "{error}");
    assert!(error.ends_with("; copy or download it again"), "{error}");
    // Wherever the cut is, there is an error and no panic.
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
    // The metadata of the file lie in its first 2 kB.
    for at in 8..2048 {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x5a;
        std::fs::write(&path, bytes).unwrap();
        // A flip in a time stamp or in padding may still read; only a panic fails.
        let _ = PushTrial::read(&path);
    }
}

#[test]
fn streams_that_are_missing_or_of_another_layout() {
    assert_eq!(
        refusal("block=steel_run=01.json", br#"{"tip_pose": [], "ft_wrench": []}"#),
        "F: stream `object_pose` is missing; the file has: ft_wrench, tip_pose; a trial needs tip_pose, \
         object_pose and ft_wrench: copy or download it again, or take it out"
    );
    assert_eq!(
        json("[[0, 1]]", GOOD, GOOD),
        "F: stream `tip_pose`: row 0 has 2 numbers; store it as rows of four numbers: time and three values"
    );
    assert!(json("\"none\"", GOOD, GOOD).starts_with("F: stream `tip_pose`: other than rows of numbers"));
    assert_eq!(
        json(GOOD, "[[0, 0, 0, 0]]", GOOD),
        "F: stream `object_pose`: fewer than two samples at different times; take the trial out"
    );
    assert_eq!(
        json(GOOD, GOOD, "[[5, 0, 0, 0], [6, 0, 0, 0]]"),
        "F: tip_pose, object_pose and ft_wrench have no time in common; check that their clocks are the same, or \
         take the trial out"
    );
    let cut = br#"{"tip_pose": [[0, 0, 0, 0], [1, 0"#;
    assert!(refusal("block=al_run=01.json", cut).starts_with("F: not valid JSON (EOF while parsing"));
    assert_eq!(
        refusal("block=al_run=01.json", b"hello"),
        "F: neither HDF5, JSON nor a zip archive of them, judged by its first bytes; copy or download it again"
    );
}

#[test]
fn values_that_are_no_numbers_and_time_that_runs_backwards() {
    let refused = "F: stream `object_pose`, row 1: a value is not a finite number; remove the row";
    for value in ["NaN", "-Infinity", "null"] {
        assert_eq!(json(GOOD, &format!("[[0, 0, 0, 0],\n [1, 0, {value}, 0]]"), GOOD), refused, "{value}");
    }
    assert_eq!(
        json("[[0, 0, 0, 0], [2, 0, 0, 0], [1, 0, 0, 0]]", GOOD, GOOD),
        "F: stream `tip_pose`, row 2: time 1 s after 2 s; sort the rows by time, or take the trial out if its \
         clock was reset"
    );
}

#[test]
fn names_of_other_things_are_refused() {
    let text = |name: &str| TrialName::parse(Path::new(name)).unwrap_err().to_string();
    assert_eq!(
        text(&NAME.replace("abs", "marble")),
        format!(
            "{}: file name: unknown surface `marble`; known are abs, delrin, plywood, pu; correct the name or \
             take the file out",
            NAME.replace("abs", "marble")
        )
    );
    assert!(
        text(&NAME.replace("tri1", "tri4")).contains("unknown shape `tri4`; known are rect1, rect2, rect3")
    );
    assert!(text("block=gold_run=01").contains("unknown block `gold`; known are steel, al, plastic"));
    assert!(text(&NAME.replace("i=1.000", "i=3.000")).contains("`i=3.000` is not within 0 to 2"));
    assert!(text(&NAME.replace("_v=20", "")).contains("`v=` expected where"));
    assert!(text(&NAME.replace("a=0", "a=x")).contains("`a=x` is not a number"));
    assert!(text("drops.json").contains("`block=` expected"));
    assert!(text("drops.json").contains("rename the file or take it out"));
}

#[test]
fn the_same_trial_twice_and_folders_without_any() {
    let folder = tempfile::tempdir().unwrap();
    let error = read_push_trials(folder.path()).unwrap_err().to_string();
    assert!(error.contains("no push file in it; expected `.h5`, `.json` or `.zip` files"), "{error}");
    for inner in ["h5", "json"] {
        std::fs::create_dir(folder.path().join(inner)).unwrap();
        std::fs::write(folder.path().join(inner).join(format!("{NAME}.h5")), hdf5()).unwrap();
    }
    let error = read_push_trials(folder.path()).unwrap_err().to_string();
    assert!(error.contains("the trial is also in") && error.contains("convert one of the two"), "{error}");
}

/// The name of a member becomes part of the path in every message about it.
#[test]
fn a_member_whose_name_cannot_be_printed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pushes.zip");
    for name in ["abs/\u{1b}[31m.json".to_owned(), format!("abs/{}.json", "x".repeat(300))] {
        let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.finish().unwrap();
        let error = read_push_trials(&path).unwrap_err().to_string();
        assert!(error.ends_with("is too long or holds control characters; rename it"), "{error}");
        assert!(!error.contains('\u{1b}') && error.len() < 400, "{error}");
    }
}

fn conversion(set: &str, path: &Path) -> String {
    let (_, convert) = CONVERTERS.iter().find(|(name, _)| *name == set).expect("a converter");
    convert(path).expect_err("faulty").to_string().replace(&path.display().to_string(), "F")
}

#[test]
fn runs_and_logs_that_are_broken() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("run.csv");
    let header = "t_s,pusher_x_m,pusher_y_m,slider_x_m,slider_y_m,slider_th_rad,pusher_new,slider_new\n";
    std::fs::write(&path, format!("{header}1,0,0,0,0,0,1,1\n0.9,0,0,0,0,0,1,1\n")).unwrap();
    assert_eq!(
        conversion("mit-pusher-slider", &path),
        "F: line 3, column `t_s`: time 0.9 s after 1 s in trajectory `run`; sort its rows by time and remove \
         repeated ones"
    );
    std::fs::write(&path, "t_s,pusher_x_m\n").unwrap();
    assert!(conversion("mit-pusher-slider", &path).contains("column `pusher_new` is missing"));
    std::fs::write(folder.path().join("index.csv"), "file,perturbations\nruns/a.csv,none\n").unwrap();
    assert!(
        conversion("mit-pusher-slider", folder.path())
            .ends_with("index.csv: lists `runs/a.csv`, which is not there; restore it or remove its row")
    );
    std::fs::write(&path, "1\n1 2 3 1 0 0 0\n1 2 3 1 0 0 0\n2\n0 0 0\n").unwrap();
    assert_eq!(
        conversion("cmu-mlab", &path),
        "F: line 6: a force sample of three numbers expected; the log is damaged or cut off: copy or download it \
         again"
    );
    assert!(conversion("cmu-mlab", folder.path()).contains("expected `sensor_log/*.txt`"));
}

#[test]
fn npz_without_what_is_needed() {
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
