//! Contract: bad input gives one clear error with the file and a remedy, exit code 2 (usage) or 3 (bad
//! data), no panic and no partial output.

use crate::command::augsim;
use std::path::{Path, PathBuf};
use std::process::Command;

const GOOD: &str = "trajectory,t_s,height_m,velocity_m_s\n\
    a,0,4.5,0\na,0.016666666666666666,4.49,-0.1\n\
    b,0,4.2,0\nb,0.016666666666666666,4.19,-0.1\n";

/// Runs `train` on a file with the given bytes, which must fail with `code` and `texts` and write no run.
fn refuses(name: &str, bytes: &[u8], code: i32, texts: &[&str]) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(dir.path().join(name), bytes).expect("it can be written");
    let out = augsim(
        &["train", "--pybullet-ball", "--data", name, "--out", "run", "--iterations", "3"],
        dir.path(),
    );
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "{name}: {error}");
    assert!(!error.contains("panicked"), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "one error, one paragraph: {error}");
    for text in texts.iter().chain([&name]) {
        assert!(error.contains(text), "{name}: `{text}` is not in: {error}");
    }
    assert!(!dir.path().join("run/checkpoint.bin").exists());
    assert!(!dir.path().join("run/config.resolved.toml").exists());
}

#[test]
fn a_missing_column_is_named() {
    refuses("no_velocity.csv", b"trajectory,t_s,height_m\na,0,4.5\na,0.0166666,4.49\n", 3, &["velocity_m_s"]);
}

#[test]
fn a_nan_is_located() {
    let text = GOOD.replace("4.49", "NaN");
    refuses("nan.csv", text.as_bytes(), 3, &["line 3", "height_m", "NaN"]);
}

#[test]
fn locates_repeated_times() {
    // Unsorted rows are sorted; two different samples at one time are an error.
    let text = GOOD.replace("a,0.016666666666666666", "a,0");
    refuses("still.csv", text.as_bytes(), 3, &["line 3", "t_s"]);
}

#[test]
fn rejects_empty_files_and_files_with_a_header_only() {
    refuses("empty.csv", b"", 3, &["empty"]);
    refuses("header.csv", b"trajectory,t_s,height_m,velocity_m_s\n", 3, &[]);
}

#[test]
fn rejects_another_sampling_rate() {
    let text = GOOD.replace("0.016666666666666666", "0.02");
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("rate.csv"), text).unwrap();
    let out = augsim(&["train", "--pybullet-ball", "--data", "rate.csv", "--out", "run"], dir.path());
    assert_eq!(out.status.code(), Some(3));
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(error.contains("`a`") && error.contains("0.01666"), "{error}");
}

#[test]
fn a_truncated_gzip_is_an_error() {
    use std::io::Write;
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gz.write_all(GOOD.repeat(50).as_bytes()).unwrap();
    let whole = gz.finish().unwrap();
    refuses("cut.csv.gz", &whole[..whole.len() / 2], 3, &["gzip"]);
}

#[test]
fn a_missing_file_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let out = augsim(&["data", "inspect", "nowhere.csv"], dir.path());
    assert_eq!(out.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&out.stderr).contains("nowhere.csv"));
}

/// Makes a tiny finished run and a test file in a temporary folder.
fn trained() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(dir.path().join("good.csv"), GOOD).expect("it can be written");
    let args = [
        "train",
        "--pybullet-ball",
        "--data",
        "good.csv",
        "--out",
        "run",
        "--iterations",
        "2",
        "--recipe",
        "neural",
    ];
    let out = augsim(&args, dir.path());
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let checkpoint = dir.path().join("run/checkpoint.bin");
    (dir, checkpoint)
}

fn evaluation_error(dir: &Path) -> String {
    let out = augsim(&["evaluate", "run", "--data", "good.csv"], dir);
    assert_eq!(out.status.code(), Some(3));
    String::from_utf8_lossy(&out.stderr).into_owned()
}

#[test]
fn damaged_checkpoints_are_named() {
    let (dir, checkpoint) = trained();
    let out = augsim(&["evaluate", "run", "--data", "good.csv", "--json"], dir.path());
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let whole = std::fs::read(&checkpoint).unwrap();

    std::fs::write(&checkpoint, &whole[..whole.len() / 2]).unwrap();
    let error = evaluation_error(dir.path());
    assert!(error.contains("checkpoint.bin") && error.contains("damaged"), "{error}");

    let mut other = whole.clone();
    other[8] = 250;
    std::fs::write(&checkpoint, other).unwrap();
    let error = evaluation_error(dir.path());
    assert!(error.contains("version 250"), "{error}");

    std::fs::write(&checkpoint, b"something else").unwrap();
    assert!(evaluation_error(dir.path()).contains("not an augsim checkpoint"));
}

#[test]
fn faulty_push_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let convert = |name: &str, bytes: &[u8], texts: &[&str]| {
        std::fs::write(dir.path().join(name), bytes).unwrap();
        let out = augsim(&["data", "convert", "mit-push", name, "pushes.csv"], dir.path());
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(3), "{error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
        for text in texts.iter().chain([&name]) {
            assert!(error.contains(text), "{name}: `{text}` is not in: {error}");
        }
        assert!(!dir.path().join("pushes.csv").exists());
    };
    let fixture = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000.h5";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mit-push").join(fixture);
    let whole = std::fs::read(path).unwrap();
    convert(fixture, &whole[..whole.len() / 2], &["`tip_pose`", "cut off", "download it again"]);
    convert(&fixture.replace("tri1", "star"), &whole, &["unknown shape `star`", "rect1", "butter"]);
    let streams = br#"{"tip_pose": [[0, 0, 0, 0], [1, 0, 0, 0]]}"#;
    convert("block=al_run=01.json", streams, &["`object_pose` is missing", "tip_pose"]);

    std::fs::write(dir.path().join(fixture), &whole).unwrap();
    let out = augsim(&["data", "convert", "mit-push", fixture, "pushes.csv", "--rate-hz", "20"], dir.path());
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let model = std::fs::read_to_string(dir.path().join("pushes.model.toml")).unwrap();
    assert!(model.contains("object = \"tri1\""));
    let unknown = augsim(&["data", "convert", "mit-pull", fixture, "pushes.csv"], dir.path());
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("mit-pusher-slider"));
}

#[test]
fn names_an_unknown_group_and_the_known_ones() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let grouped =
        "trajectory,group,t_s,height_m\na,wood,0,4.5\na,wood,0.1,4.4\nb,steel,0,4.2\nb,steel,0.1,4.1\n";
    let write =
        |name: &str, text: &str| std::fs::write(dir.path().join(name), text).expect("it can be written");
    write("grouped.csv", grouped);
    write("plain.csv", GOOD);
    write("model.toml", "scenario = \"ball\"\n");
    for (data, texts) in
        [("grouped.csv", ["steel, wood", "--group glass"]), ("plain.csv", ["no column `group`", "leave"])]
    {
        let out = augsim(&["discover", "model.toml", data, "--group", "glass", "--out", "found"], dir.path());
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{error}");
        for text in texts.iter().chain([&data]) {
            assert!(error.contains(text), "`{text}` is not in: {error}");
        }
        assert!(!dir.path().join("found").exists());
    }
}

#[test]
fn usage_errors_have_code_2() {
    let (dir, _) = trained();
    let again = augsim(&["train", "--pybullet-ball", "--data", "good.csv", "--out", "run"], dir.path());
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--resume"));
    for args in [&["train", "--recipe", "magic"][..], &["flY"], &["train", "--iterations", "0"]] {
        assert_eq!(augsim(args, dir.path()).status.code(), Some(2), "{args:?}");
    }
}

#[test]
fn an_instruction_set_that_is_not_there_has_code_2() {
    let output = Command::new(env!("CARGO_BIN_EXE_augsim"))
        .args(["data", "inspect", "none.csv"])
        .env("AUGSIM_SIMD", "mmx")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        text.contains("AUGSIM_SIMD=mmx is not an instruction set of this machine; set it to one of: scalar"),
        "{text}"
    );
}

#[test]
fn a_criterion_that_is_not_met_has_code_1() {
    let (dir, _) = trained();
    let with = |limit: &str| {
        let args = ["evaluate", "run", "--data", "good.csv", "--require-pos-m", limit];
        augsim(&args, dir.path()).status.code()
    };
    assert_eq!([with("1000"), with("0.000001")], [Some(0), Some(1)]);
}
