//! Contract (issue 13, item 6): every limit can be changed by the environment variable in its message;
//! an unknown variable is a usage error, an option beyond a limit is a usage error (code 2), and a file
//! beyond a limit is bad data (code 3). The tests lower the limits, so that they need no gigabytes.

use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Runs `augsim` with the environment variables `limits`; returns exit code and standard error.
fn augsim(dir: &Path, args: &[&str], limits: &[(&str, &str)]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
    command
        .args(args)
        .current_dir(dir)
        .envs(limits.iter().map(|(name, value)| (format!("AUGSIM_LIMIT_{name}"), value)));
    let begin = Instant::now();
    let out = command.output().expect("the binary runs");
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!error.contains("panicked"), "{args:?}: {error}");
    assert!(begin.elapsed() < Duration::from_secs(20), "{args:?} took {:?}", begin.elapsed());
    (out.status.code(), error)
}

fn drops(trajectories: usize) -> String {
    let row = |k: usize| format!("d{k},0,4,0\nd{k},0.5,2.8,-4.9\n");
    format!("trajectory,t_s,height_m,velocity_m_s\n{}", (0..trajectories).map(row).collect::<String>())
}

#[test]
fn a_file_beyond_a_limit_is_read_once_the_limit_is_raised() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("drops.csv"), drops(20)).unwrap();
    for (name, low, enough, says) in [
        ("BYTES", "100", "1e6", "has too many bytes"),
        ("CELLS", "100", "1e3", "has too many values"),
        ("COLUMNS", "3", "4", "has too many columns"),
        ("TRAJECTORIES", "19", "20", "has too many trajectories"),
    ] {
        let (code, error) = augsim(dir.path(), &["data", "inspect", "drops.csv"], &[(name, low)]);
        assert_eq!(code, Some(3), "{error}");
        assert!(error.contains(says) && error.contains("drops.csv"), "{error}");
        assert!(
            error.contains(&format!("(the limit is {low}; set AUGSIM_LIMIT_{name} to allow more)")),
            "{error}"
        );
        let (code, error) = augsim(dir.path(), &["data", "inspect", "drops.csv"], &[(name, enough)]);
        assert_eq!(code, Some(0), "{error}");
    }
}

#[test]
fn rejects_archives_that_unpack_beyond_the_limit() {
    let dir = tempfile::tempdir().unwrap();
    let zeros = vec![b'0'; 4 << 20];
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(b"trajectory,t_s,x_m\na,0,").and_then(|()| gzip.write_all(&zeros)).unwrap();
    let member = gzip.finish().unwrap();
    std::fs::write(dir.path().join("bomb.csv.gz"), &member).unwrap();
    // Each member is within the limit, but not their sum.
    let mut small = GzEncoder::new(Vec::new(), Compression::best());
    small.write_all(&zeros[..900_000]).unwrap();
    std::fs::write(dir.path().join("members.csv.gz"), small.finish().unwrap().repeat(3)).unwrap();
    for (archive, name) in [("bomb.npz", "t_s.npy"), ("bomb.zip", "block=al_run=01.json")] {
        let mut zip = zip::ZipWriter::new(std::fs::File::create(dir.path().join(archive)).unwrap());
        zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(&zeros).unwrap();
        zip.finish().unwrap();
    }
    for name in ["bomb.csv.gz", "members.csv.gz", "bomb.npz", "bomb.zip"] {
        let (code, error) = augsim(dir.path(), &["data", "inspect", name], &[("BYTES", "1e6")]);
        assert_eq!(code, Some(3), "{name}: {error}");
        assert!(error.contains("has too many bytes after unpacking"), "{name}: {error}");
    }
    let endless = Path::new("/dev/zero");
    if endless.exists() {
        let (code, error) = augsim(dir.path(), &["data", "inspect", "/dev/zero"], &[("BYTES", "1e6")]);
        assert_eq!((code, error.contains("has too many bytes")), (Some(3), true), "{error}");
        let (code, error) = augsim(dir.path(), &["discover", "/dev/zero", "/dev/zero"], &[]);
        assert_eq!((code, error.contains("too long for a text file")), (Some(3), true), "{error}");
    }
}

#[test]
fn rejects_unknown_and_non_numeric_limits() {
    let dir = tempfile::tempdir().unwrap();
    for (name, value, says) in [
        ("CELL", "5", "AUGSIM_LIMIT_CELL is not a known limit; the limits are AUGSIM_LIMIT_BYTES"),
        ("CELLS", "many", "AUGSIM_LIMIT_CELLS=many: must be a whole number"),
        ("CELLS", "0", "AUGSIM_LIMIT_CELLS=0: must be a whole number"),
    ] {
        let (code, error) = augsim(dir.path(), &["data", "inspect", "none.csv"], &[(name, value)]);
        assert_eq!(code, Some(2), "{error}");
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn rejects_options_beyond_a_limit_without_output() {
    let dir = tempfile::tempdir().unwrap();
    let simulate = |more: &[&str], says: &str| {
        let (code, error) = augsim(dir.path(), &[&["simulate", "--out", "x.csv"], more].concat(), &[]);
        assert_eq!(code, Some(2), "{more:?}: {error}");
        assert!(error.contains(says), "{more:?}: {error}");
        assert!(!dir.path().join("x.csv").exists());
    };
    simulate(&["--trajectories", "4294967295"], "has too many trajectories");
    simulate(&["--samples", "4294967295", "--trajectories", "1"], "has too many samples");
    simulate(&["--samples", "900000", "--trajectories", "1000"], "has too many values");
    let push = ["--scenario", "push", "--trajectories", "3", "--rate-hz"];
    for rate in ["1e300", "1e-9", "0", "1e-300"] {
        simulate(&[&push[..], &[rate]].concat(), "`rate_hz`");
    }
    simulate(&["--scenario", "push", "--trajectories", "4294967295"], "has too many trajectories");
    simulate(&["--scenario", "push", "--trajectories", "500000", "--rate-hz", "1000"], "has too many values");

    let fixture = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000.h5";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mit-push").join(fixture);
    let set = ["data", "convert", "mit-push", path.to_str().unwrap(), "pushes.csv", "--rate-hz"];
    for (rate, says) in
        [("1e300", "too many samples"), ("0", "give a positive rate"), ("NaN", "give a positive rate")]
    {
        let (code, error) = augsim(dir.path(), &[&set[..], &[rate]].concat(), &[]);
        assert_eq!(code, Some(2), "{rate}: {error}");
        assert!(error.contains(says), "{rate}: {error}");
        assert!(!dir.path().join("pushes.csv").exists());
    }
}

#[test]
fn limits_the_size_of_the_network_of_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let rows = |k: usize| format!("d{k},0,4,0\nd{k},0.016666666666666666,3.998,-0.16\n");
    let text = format!("trajectory,t_s,height_m,velocity_m_s\n{}{}", rows(0), rows(1));
    std::fs::write(dir.path().join("good.csv"), text).unwrap();
    let train = [
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
    let (code, error) = augsim(dir.path(), &train, &[]);
    assert_eq!(code, Some(0), "{error}");
    let (code, error) =
        augsim(dir.path(), &["evaluate", "run", "--data", "good.csv"], &[("PARAMETERS", "1000")]);
    assert_eq!(code, Some(3), "{error}");
    assert!(error.contains("too many parameters") && error.contains("AUGSIM_LIMIT_PARAMETERS"), "{error}");
    let predict = ["predict", "run", "--data", "good.csv", "--out", "f.csv", "--samples", "4294967295"];
    let (code, error) = augsim(dir.path(), &predict, &[]);
    assert_eq!(code, Some(2), "{error}");
    assert!(error.contains("--samples 4294967295: each forecast has too many values"), "{error}");
}
