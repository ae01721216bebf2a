//! Contract (issue 13, items 11 and 12): a file gives the same data from a path, standard input and a
//! FIFO, and a discovery opens its model and its data once; the content of a file cannot send terminal
//! escapes; and errors name the fault and a working remedy. The texts of single faults are tested in
//! `crates/data/tests/it/csv_errors.rs`; these tests cover texts that were wrong.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn command(dir: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
    command.args(args).current_dir(dir);
    command
}

fn augsim(dir: &Path, args: &[&str]) -> Output {
    command(dir, args).output().expect("the binary runs")
}

/// Returns the standard error of a command that fails with code 3.
fn refusal(dir: &Path, args: &[&str]) -> String {
    let out = augsim(dir, args);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(3), "{args:?}: {error}");
    assert_eq!(error.trim_end().lines().count(), 1, "one error, one paragraph: {error}");
    error
}

fn write(dir: &Path, name: &str, bytes: impl AsRef<[u8]>) {
    std::fs::write(dir.join(name), bytes).expect("a writable temporary folder");
}

const GOOD: &str =
    "trajectory,t_s,height_m,velocity_m_s\na,0,4.5,0\na,0.5,3.2,-4.9\nb,0,4.2,0\nb,0.5,2.9,-4.9\n";

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory")
}

#[test]
fn reads_standard_input_and_fifos_from_the_first_byte() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "good.csv", GOOD);
    let expected = augsim(dir.path(), &["data", "inspect", "good.csv", "--json"]).stdout;
    let expected = String::from_utf8(expected).unwrap();
    for name in ["-", "/dev/stdin"] {
        for content in [GOOD.as_bytes().to_vec(), gzip(GOOD.as_bytes())] {
            let mut child = command(dir.path(), &["data", "inspect", name, "--json"])
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()
                .expect("the binary runs");
            child.stdin.take().expect("a pipe").write_all(&content).expect("it is read");
            let out = child.wait_with_output().expect("it ends");
            assert_eq!(out.status.code(), Some(0), "{name}");
            assert_eq!(String::from_utf8(out.stdout).unwrap(), expected.replace("good.csv", name), "{name}");
        }
    }
    let fifo = dir.path().join("fifo");
    if Command::new("mkfifo").arg(&fifo).status().is_ok_and(|status| status.success()) {
        let child = command(dir.path(), &["data", "inspect", "fifo", "--json"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        std::fs::write(&fifo, GOOD).expect("a reader waits");
        let out = child.wait_with_output().unwrap();
        assert_eq!(String::from_utf8(out.stdout).unwrap(), expected.replace("good.csv", "fifo"));
    }
}

const SWING: &str = r#"
scenario = "system"
name = "pendulum"
[states]
theta_rad = { start = "angle_rad" }
omega_rad_s = { start = "slope(angle_rad)" }
[parameters]
stiffness_per_s2 = { nominal = 30.0, min = 1.0, max = 100.0 }
[rates]
theta_rad = "omega_rad_s"
omega_rad_s = "-stiffness_per_s2 * sin(theta_rad)"
[outputs]
angle_rad = { value = "theta_rad", sd = "estimate" }
"#;

#[test]
fn discover_opens_a_model_of_equations_and_its_data_once() {
    let dir = tempfile::tempdir().unwrap();
    let swings = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/recipes/data/swings.csv");
    let swings = std::fs::read(swings).expect("a file of the documents");
    write(dir.path(), "swing.toml", SWING);
    write(dir.path(), "swings.csv", &swings);
    let discover = |model: &str, data: &str, out: &str| {
        command(dir.path(), &["discover", model, data, "--only", "linear-damping", "--out", out])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the binary runs")
    };
    let found = |mut child: std::process::Child, out: &str, input: &[u8]| {
        child.stdin.take().expect("a pipe").write_all(input).expect("it is read");
        let status = child.wait_with_output().expect("it ends").status;
        assert_eq!(status.code(), Some(0), "{out}");
        std::fs::read_to_string(dir.path().join(out).join("model.toml")).expect("written")
    };
    let from_files = found(discover("swing.toml", "swings.csv", "files"), "files", b"");
    let from_input = found(discover("swing.toml", "-", "input"), "input", &swings);
    assert_eq!(from_input, from_files);
    let fifo = dir.path().join("fifo");
    if Command::new("mkfifo").arg(&fifo).status().is_ok_and(|status| status.success()) {
        let child = discover("fifo", "swings.csv", "pipe");
        std::fs::write(&fifo, SWING).expect("a reader waits");
        assert_eq!(found(child, "pipe", b""), from_files);
    }
}

#[test]
fn terminal_escapes_in_cells_and_names_are_never_printed_raw() {
    let dir = tempfile::tempdir().unwrap();
    // The reader keeps C1 controls and bidirectional overrides in labels, as they are not C0 controls.
    write(dir.path(), "group.csv", "trajectory,group,t_s,x_m\na,re\u{202e}d,0,1\nb,\u{feff}x,0,2\n");
    write(dir.path(), "cell.csv", "trajectory,t_s,x_m\na,0,\u{1b}[31m1\n");
    write(dir.path(), "model.toml", "scenario = \"ball\"\n\"\\u001b[31m\\u0007\" = 1\n");
    write(dir.path(), "name\u{1b}[31m.csv", "trajectory,t_s,x_m\n");
    for args in [
        &["data", "inspect", "group.csv"][..],
        &["data", "inspect", "group.csv", "--json"],
        &["data", "inspect", "cell.csv"],
        &["data", "inspect", "name\u{1b}[31m.csv"],
        &["data", "inspect", "no\u{9b}31m.csv"],
        &["discover", "model.toml", "cell.csv"],
        &["discover", "no\u{1b}.toml", "cell.csv"],
        &["data", "convert", "\u{1b}[31m", "cell.csv", "out.csv"],
    ] {
        let out = augsim(dir.path(), args);
        let text = String::from_utf8([out.stdout, out.stderr].concat()).unwrap();
        let raw =
            text.chars().find(|&c| (c.is_control() && c != '\n') || matches!(c, '\u{202e}' | '\u{feff}'));
        assert_eq!(raw, None, "{args:?}: {text:?}");
        assert!(text.contains("\\u"), "what was there is shown: {text}");
    }
    let out = augsim(dir.path(), &["data", "inspect", "group.csv", "--json"]);
    let value: serde_json::Value = serde_json::from_slice(&out.stdout).expect("still JSON");
    assert_eq!(value["groups"]["re\u{202e}d"], 1, "{value}");
}

#[test]
fn reports_decimal_commas() {
    let dir = tempfile::tempdir().unwrap();
    let inspect = |content: &str| {
        write(dir.path(), "d.csv", content);
        refusal(dir.path(), &["data", "inspect", "d.csv"])
    };
    let error = inspect("trajectory,t_s,height_m,velocity_m_s\na,0,4,5,0\na,0,5,3,2,-4,9\n");
    assert!(
        error.contains(
            "line 2: the row has 5 cells but the header has 4; if decimals are written with commas"
        ),
        "{error}"
    );
    assert!(error.contains("write them with points (4.5, not 4,5)"), "{error}");
    // If cells are unambiguous, decimal commas are read and reported in a note.
    for content in [
        "trajectory,t_s,height_m\na,0,\"4,5\"\n",
        "trajectory;t_s;height_m\na;0;4,5\n",
        "trajectory\tt_s\theight_m\na\t0\t4,5\n",
    ] {
        write(dir.path(), "d.csv", content);
        let out = augsim(dir.path(), &["data", "inspect", "d.csv"]);
        let (text, note) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
        assert_eq!(out.status.code(), Some(0), "{note}");
        assert!(
            text.contains("height_m") && text.contains("4.5") && note.contains("decimals use commas"),
            "{text}{note}"
        );
    }
}

#[test]
fn reports_data_after_a_gzip_stream() {
    let dir = tempfile::tempdir().unwrap();
    let packed = gzip(GOOD.as_bytes());
    for junk in [&b"junk"[..], b"0123456789abcdefghijklmnopqrstuvwxyz"] {
        write(dir.path(), "junk.csv.gz", [&packed[..], junk].concat());
        let error = refusal(dir.path(), &["data", "inspect", "junk.csv.gz"]);
        let says =
            format!("{} bytes that are not gzip follow the end of the gzip stream; remove them", junk.len());
        assert!(error.contains(&says), "{error}");
    }
    // Zero padding and a second member are valid gzip.
    let (begin, end) = GOOD.split_at(60);
    write(dir.path(), "padded.csv.gz", [&packed[..], &[0; 512]].concat());
    write(dir.path(), "members.csv.gz", [gzip(begin.as_bytes()), gzip(end.as_bytes())].concat());
    for name in ["padded.csv.gz", "members.csv.gz"] {
        assert_eq!(augsim(dir.path(), &["data", "inspect", name]).status.code(), Some(0), "{name}");
    }
}

#[test]
fn reports_empty_cells_with_a_remedy() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "gap.csv", GOOD.replace("3.2", ""));
    let error = refusal(
        dir.path(),
        &["train", "--pybullet-ball", "--data", "gap.csv", "--out", "run", "--iterations", "2"],
    );
    let says =
        "line 3, column `height_m`: empty cell; every value is needed here: fill it in, or remove the row";
    assert!(error.contains(says), "{error}");
}

#[test]
fn reports_empty_and_missing_model_files() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "good.csv", GOOD);
    for empty in ["", "\n\n", "# nothing yet\n"] {
        write(dir.path(), "model.toml", empty);
        let error = refusal(dir.path(), &["discover", "model.toml", "good.csv"]);
        assert!(
            error.contains("the model file is empty; it begins with `scenario = \"ball\"` or"),
            "{error}"
        );
    }
    write(dir.path(), "model.toml", "[parameters]\nrestitution = 0.5\n");
    let error = refusal(dir.path(), &["discover", "model.toml", "good.csv"]);
    assert!(error.contains("add `scenario = \"ball\"` or `scenario = \"push\"`"), "{error}");
    let error = refusal(dir.path(), &["discover", "absent.toml", "good.csv"]);
    assert!(error.contains("absent.toml: there is no such file"), "{error}");
    write(dir.path(), "model.toml", b"scenario = \"ball\xff\"\n");
    assert!(refusal(dir.path(), &["discover", "model.toml", "good.csv"]).contains("not UTF-8"));
}

#[test]
fn reports_swapped_x_and_z() {
    let dir = tempfile::tempdir().unwrap();
    let mut rows = String::from("trajectory,t_s,x_m,z_m\n");
    for k in 0..6 {
        // Thrown from 2 m, one bounce with restitution 0.7, noise of 1 mm with a short period.
        let (up, along) = (1.0 + 0.2 * f64::from(k), 1.5);
        let impact = (up + (up * up + 4.0 * 9.81).sqrt()) / 9.81;
        for i in 0..120 {
            let t = f64::from(i) * 0.01;
            let after = t - impact;
            let z = match after > 0.0 {
                true => 0.7 * (9.81 * impact - up) * after - 4.905 * after * after,
                false => 2.0 + up * t - 4.905 * t * t,
            };
            let scatter = |phase: i32| 1e-3 * f64::from((i * 7 + phase) % 11 - 5) / 5.0;
            rows += &format!("t{k},{t},{},{}\n", along * t + scatter(k), z + scatter(3 * k + 1));
        }
    }
    write(dir.path(), "right.csv", &rows);
    write(dir.path(), "swapped.csv", rows.replace("x_m,z_m", "z_m,x_m"));
    write(
        dir.path(),
        "model.toml",
        "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
         restitution = { nominal = 0.65, min = 0.0, max = 1.0 }\n",
    );
    let error = refusal(dir.path(), &["discover", "model.toml", "swapped.csv", "--out", "found"]);
    let says = "`z_m` shows no free fall, but `x_m` falls at 9.81 m/s²; the two columns are swapped: exchange their names";
    assert!(error.contains(says), "{error}");
    let right = augsim(dir.path(), &["discover", "model.toml", "right.csv", "--out", "found"]);
    assert_eq!(right.status.code(), Some(0), "{}", String::from_utf8_lossy(&right.stderr));
}
