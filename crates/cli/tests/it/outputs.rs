//! Contract: no command overwrites its inputs under any name; results of another run are overwritten
//! only with `--force`; only regular files and folders are written; the file name determines the data
//! format; a failing command leaves no folder. Errors are reported before any work, with the path and
//! exit code 2.

use crate::command::{augsim, succeed};
use std::path::Path;
use std::process::Command;

const SEALED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/sealed");

/// Runs a command that must fail with exit code 2 and print each of `texts`.
fn refused(args: &[&str], dir: &Path, texts: &[&str]) {
    refused_with(2, args, dir, texts);
}

fn refused_with(code: i32, args: &[&str], dir: &Path, texts: &[&str]) {
    let out = augsim(args, dir);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "{args:?}: {error}");
    let last = error.trim_end().lines().last().unwrap_or_default();
    assert!(last.starts_with("augsim: error: ") && !last.contains("os error 17"), "{args:?}: {error}");
    for text in texts {
        assert!(last.contains(text), "{args:?}: `{text}` is not in: {error}");
    }
}

/// Makes a folder with the demonstration data set, ball drops, and a tiny network trained on them.
fn workplace() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    for name in ["model.toml", "bounces.csv"] {
        std::fs::copy(Path::new(SEALED).join(name), dir.path().join(name)).expect("it can be copied");
    }
    succeed(&["simulate", "--trajectories", "6", "--samples", "20", "--out", "d.csv"], dir.path());
    succeed(
        &["train", "--pybullet-ball", "--data", "d.csv", "--iterations", "2", "--out", "run"],
        dir.path(),
    );
    dir
}

fn names(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn an_output_never_replaces_an_input() {
    let dir = workplace();
    let d = dir.path();
    let keeps = |file: &str, args: &[&str]| {
        let before = std::fs::read(d.join(file)).expect("the input");
        refused(args, d, &["is the input", "would be replaced"]);
        assert!(std::fs::read(d.join(file)).expect("the input") == before, "{args:?} changed {file}");
    };
    keeps("d.csv", &["predict", "run", "--data", "d.csv", "--out", "d.csv"]);
    keeps("d.csv", &["predict", "run", "--data", "d.csv", "--out", "./run/../d.csv"]);
    keeps("run/checkpoint.bin", &["predict", "run", "--data", "d.csv", "--out", "run/checkpoint.bin"]);
    let trial = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000.h5";
    std::fs::copy(Path::new(SEALED).join("../mit-push").join(trial), d.join(trial))
        .expect("it can be copied");
    keeps(trial, &["data", "convert", "mit-push", trial, trial]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("d.csv", d.join("link.csv")).expect("a link");
        std::fs::hard_link(d.join("d.csv"), d.join("twin.csv")).expect("a second name");
        for other in ["link.csv", "twin.csv"] {
            keeps("d.csv", &["predict", "run", "--data", "d.csv", "--out", other]);
            keeps("d.csv", &["predict", "run", "--data", other, "--out", "d.csv"]);
        }
    }
    // Files that are not on the command line.
    std::fs::create_dir(d.join("both")).expect("a folder");
    std::fs::copy(d.join("model.toml"), d.join("both/model.toml")).expect("it can be copied");
    keeps("both/model.toml", &["discover", "both/model.toml", "bounces.csv", "--out", "both"]);
    keeps("both/model.toml", &["discover", "both/model.toml", "bounces.csv", "--out", "both", "--force"]);
    assert_eq!(names(&d.join("both")), ["model.toml"]);
}

#[test]
fn rejects_the_folder_of_another_run_without_force() {
    let dir = workplace();
    let d = dir.path();
    let discover = ["discover", "model.toml", "bounces.csv", "--out", "found"];
    let with = |more: &[&'static str]| [&discover[..], more].concat();
    succeed(&discover, d);
    let first = std::fs::read(d.join("found/result.json")).expect("a result");
    refused(&with(&["--seed", "2"]), d, &["found", "seed is 1 there and 2 here", "--force"]);
    refused(&with(&["--null-runs", "5"]), d, &["null-runs is 19 there and 5 here"]);
    std::fs::write(d.join("other.toml"), "# other\nscenario = \"ball\"\n").expect("a model");
    let other = ["discover", "other.toml", "bounces.csv", "--out", "found"];
    refused(&other, d, &["the content of model is"]);
    assert!(std::fs::read(d.join("found/result.json")).expect("a result") == first);
    succeed(&discover, d);
    assert!(
        std::fs::read(d.join("found/result.json")).expect("a result") == first,
        "the same run may be repeated"
    );
    // A missing file is told before any clash, and an edited input is the same input.
    let missing = ["discover", "nope.toml", "bounces.csv", "--out", "found"];
    let out = augsim(&missing, d);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(error.contains("nope.toml: there is no such file or folder"), "{error}");
    let model = std::fs::read_to_string(d.join("model.toml")).expect("a model");
    std::fs::write(d.join("model.toml"), format!("# edited\n{model}")).expect("a model");
    succeed(&discover, d);
    std::fs::write(d.join("model.toml"), model).expect("a model");
    succeed(&with(&["--seed", "2", "--force"]), d);
    refused(&discover, d, &["seed is 2 there and 1 here"]);

    refused(
        &["train", "--pybullet-ball", "--data", "d.csv", "--out", "found"],
        d,
        &["result.json", "--force"],
    );
    refused(
        &["discover", "model.toml", "bounces.csv", "--out", "run"],
        d,
        &["config.resolved.toml", "--force"],
    );
    refused(
        &["train", "--pybullet-ball", "--data", "d.csv", "--out", "run"],
        d,
        &["checkpoint.bin", "--resume", "--force"],
    );
    succeed(
        &["train", "--pybullet-ball", "--data", "d.csv", "--out", "run", "--iterations", "3", "--force"],
        d,
    );
    // An edited model file is not overwritten either.
    let trial = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000.h5";
    let fixture = Path::new(SEALED).join("../mit-push").join(trial);
    let fixture = fixture.to_str().expect("a text");
    let convert = ["data", "convert", "mit-push", fixture, "push.csv", "--rate-hz", "20"];
    succeed(&convert, d);
    succeed(&convert, d);
    std::fs::write(d.join("push.model.toml"), "# mine\n").expect("a model");
    refused(&convert, d, &["push.model.toml", "--force"]);
    assert_eq!(std::fs::read(d.join("push.model.toml")).expect("a model"), b"# mine\n");
}

#[test]
fn a_reproduction_keeps_its_networks_and_names_changed_settings() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    let run = ["reproduce", "ball", "--iterations", "2", "--test-drops", "3", "--out", "ball"];
    let with = |more: &[&'static str]| [&run[..], more].concat();
    succeed(&run, d);
    let nets = || {
        ["neural", "hybrid-plus"].map(|net| std::fs::read(d.join("ball").join(net).join("checkpoint.bin")))
    };
    let first = nets().map(|net| net.expect("a net"));
    refused(&run, d, &["already contains a net of this run", "--resume"]);
    refused(&with(&["--resume", "--seed", "2"]), d, &["seed is 1 there and 2 here"]);
    refused(
        &["reproduce", "ball", "--iterations", "4", "--test-drops", "3", "--out", "ball", "--resume"],
        d,
        &["iterations is 2 there and 4 here"],
    );
    assert!(nets().map(|net| net.expect("a net")) == first);
    succeed(&with(&["--resume"]), d);
    assert!(nets().map(|net| net.expect("a net")) == first);
    // An edited run directory inside is not a reason to delete it.
    let config = d.join("ball/neural/config.resolved.toml");
    let text = std::fs::read_to_string(&config).expect("a configuration");
    std::fs::write(&config, text.replace("hidden = 16", "hidden = 17")).expect("it can be written");
    refused(&with(&["--resume"]), d, &["ball/neural", "settings.net.hidden is 17 there and 16 here"]);
    succeed(&with(&["--force"]), d);
    assert!(nets().map(|net| net.expect("a net")) == first);
}

#[test]
fn rejects_a_missing_data_folder_of_a_reproduction() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let args = ["reproduce", "ball", "--data", "nowhere", "--quick", "-q", "--out", "ball"];
    refused_with(3, &args, dir.path(), &["nowhere", "the folder does not exist", "omit --data"]);
    assert!(names(dir.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn writes_only_regular_files_and_folders() {
    let dir = workplace();
    let d = dir.path();
    let made = Command::new("mkfifo").arg(d.join("pipe.csv")).status().expect("mkfifo runs");
    assert!(made.success());
    std::os::unix::fs::symlink("/dev/null", d.join("null.csv")).expect("a link");
    std::os::unix::fs::symlink("gone.csv", d.join("dangling.csv")).expect("a link");
    std::fs::create_dir(d.join("folder.csv")).expect("a folder");
    for (out, text) in [
        ("/dev/null", "only regular files"),
        ("null.csv", "only regular files"),
        ("pipe.csv", "only regular files"),
        ("dangling.csv", "link to a file that does not exist"),
        ("folder.csv", "is a folder"),
        ("d.csv/new.csv", "is not a folder"),
    ] {
        refused(&["simulate", "--trajectories", "2", "--out", out], d, &[text]);
        refused(&["predict", "run", "--data", "d.csv", "--out", out], d, &[text]);
    }
    // A folder at the path of a file is reported before the work.
    for out in ["d.csv", "d.csv/deeper", "/dev/null"] {
        refused(&["discover", "model.toml", "bounces.csv", "--out", out], d, &["is not a folder", "--out"]);
        refused(
            &["train", "--pybullet-ball", "--data", "d.csv", "--out", out],
            d,
            &["is not a folder", "--out"],
        );
    }
}

#[test]
fn file_name_determines_the_data_format() {
    let dir = workplace();
    let d = dir.path();
    for (args, out) in [
        (&["simulate", "--trajectories", "3", "--samples", "9"][..], "drops"),
        (&["simulate", "--scenario", "push", "--trajectories", "2", "--rate-hz", "20"], "pushes"),
        (&["predict", "run", "--data", "d.csv", "--samples", "3"], "forecast"),
    ] {
        for (ending, begin) in [("npz", &b"PK"[..]), ("csv.gz", &[0x1f, 0x8b]), ("csv", b"trajectory,")] {
            let name = format!("{out}.{ending}");
            succeed(&[args, &["--out", &name]].concat(), d);
            let bytes = std::fs::read(d.join(&name)).expect("a file");
            assert!(bytes.starts_with(begin), "{name} begins with {:?}", &bytes[..4]);
            let summary = augsim(&["data", "inspect", &name], d);
            assert!(summary.status.success(), "{name}: {}", String::from_utf8_lossy(&summary.stderr));
        }
        for name in ["data.txt", "data", "data.gz", ".npz", "data.NPZ.bak"] {
            refused(&[args, &["--out", name]].concat(), d, &[".csv, .csv.gz or .npz", name]);
        }
    }
    assert!(d.join("drops.truth.csv").exists() && !d.join("drops.npz.truth.csv").exists());
}

#[test]
fn a_failing_command_leaves_no_folder_behind() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let d = dir.path();
    std::fs::write(d.join("bad.csv"), "trajectory,t_s,height_m\na,0,x\n").expect("a file");
    std::fs::write(d.join("model.toml"), "scenario = \"ball\"\n").expect("a file");
    std::fs::create_dir(d.join("empty")).expect("a folder");
    let before = names(d);
    for args in [
        &["train", "--pybullet-ball", "--data", "bad.csv", "--out", "new/run"][..],
        &["train", "--resume", "--out", "new/run"],
        &["train", "--pybullet-ball", "--data", "nowhere.csv", "--out", "new/run"],
        &["discover", "model.toml", "bad.csv", "--out", "new/found"],
        &["discover", "nowhere.toml", "bad.csv", "--out", "new/found"],
        &["predict", "nowhere", "--data", "bad.csv", "--out", "new/forecast.csv"],
        &["simulate", "--scenario", "push", "--rate-hz", "-1", "--out", "new/push.csv"],
        &["data", "convert", "mit-push", "bad.csv", "new/pushes.csv"],
        &["data", "convert", "mit-push", "--out", "new/set"],
        &["reproduce", "ball", "--data", "empty", "--out", "new/ball"],
        &["reproduce", "push", "--data", "empty", "--out", "new/push"],
    ] {
        let out = augsim(args, d);
        assert!(
            matches!(out.status.code(), Some(2 | 3)),
            "{args:?}: {}",
            String::from_utf8_lossy(&out.stderr)
        );
        assert_eq!(names(d), before, "{args:?}");
    }
}

#[cfg(unix)]
#[test]
fn reports_a_full_disk_with_the_path_and_leaves_nothing() {
    let dir = workplace();
    let d = dir.path();
    // A file-size limit fails like a full disk: in the middle of a file.
    let limited = |args: &str| {
        let script = format!("trap '' XFSZ; ulimit -f 8; exec \"$0\" {args}");
        let mut sh = Command::new("sh");
        sh.args(["-c", &script, env!("CARGO_BIN_EXE_augsim")]).current_dir(d).output().expect("a shell")
    };
    let before = names(d);
    for (args, file) in [
        ("simulate --trajectories 50 --out new/drops.csv", "new/drops.csv"),
        ("predict run --data d.csv --out new/forecast.csv", "new/forecast.csv"),
        ("discover model.toml bounces.csv --out new", "new/result.json"),
        ("train --pybullet-ball --data d.csv --iterations 2 --out new", "new/checkpoint.bin"),
    ] {
        let out = limited(args);
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code().is_some_and(|code| code != 0), "{args}: {error}");
        assert!(error.contains(file), "{args}: {error}");
        assert_eq!(error.matches("os error").count(), 1, "{args}: {error}");
        if d.join("new").exists() {
            let left = names(&d.join("new"));
            assert!(!left.iter().any(|name| name.ends_with(".tmp")), "{args}: {left:?}");
            std::fs::remove_dir_all(d.join("new")).expect("it can be removed");
        }
        assert_eq!(names(d), before, "{args}");
    }
    if Path::new("/dev/full").exists() {
        let full = std::fs::File::options().write(true).open("/dev/full").expect("the full device");
        let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
        let child = command.args(["data", "inspect", "d.csv"]).current_dir(d).stdout(full);
        let out = child.stderr(std::process::Stdio::piped()).output().expect("the binary runs");
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && error.contains("standard output"), "{error}");
    }
}
