//! Contract: no small file makes a reader hang, abort or allocate gigabytes. The file is refused with a
//! message that states the limit and its environment variable, and no message repeats a long or hostile cell.
//!
//! The files are those that broke earlier readers: a header of nested brackets (the parser of numpy headers
//! takes exponential time), texts of 2^63 bytes, 100,000 columns, a data set whose header states more rows
//! than memory holds, and a megabyte in one cell. Limits that take gigabytes to exceed are tested with the
//! command-line program, where they can be lowered.

use augsim_data::push::{read_push_dataset, resample};
use augsim_data::{DataError, Dataset, Limit, MissingCells, Trajectory, read_dataset};
use std::io::Write;
use std::path::{Path, PathBuf};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

struct File {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn file(name: &str, bytes: &[u8]) -> File {
    let folder = tempfile::tempdir().expect("a writable temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a writable temporary folder");
    File { _folder: folder, path }
}

fn refusal(name: &str, bytes: &[u8]) -> DataError {
    let file = file(name, bytes);
    read_dataset(&file.path, MissingCells::AsGap).expect_err("the file is refused")
}

/// Bytes of an NPZ file with one array `t_s` that has the given header and values.
fn npz(header: &str, values: &[u8]) -> Vec<u8> {
    let mut array = b"\x93NUMPY\x01\x00".to_vec();
    array.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
    array.extend(header.as_bytes());
    array.extend(values);
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    archive.start_file("t_s.npy", SimpleFileOptions::default()).expect("a new member");
    archive.write_all(&array).expect("memory");
    archive.finish().expect("memory").into_inner()
}

#[test]
fn an_npz_header_of_nested_brackets_is_refused_at_once() {
    // In the second one the closing brackets are in strings, so matching brackets would not find the nesting.
    for (open, close) in [("[", "]"), ("[']',", "]")] {
        let descr = format!("{{'descr': {}'<f8'{}", open.repeat(40), close.repeat(40));
        let error =
            refusal("nested.npz", &npz(&format!("{descr}, 'shape': (1,), }}\n"), &[0; 8])).to_string();
        assert!(error.contains("array `t_s`: has too many brackets"), "{error}");
        assert!(error.contains("AUGSIM_LIMIT_BRACKETS"), "{error}");
    }
    let long = format!("{{'descr': '<f8', {}'shape': (1,), }}\n", " ".repeat(5000));
    let error = refusal("long.npz", &npz(&long, &[0; 8])).to_string();
    assert!(
        error.contains("a header that is too long") && error.contains("AUGSIM_LIMIT_HEADER_BYTES"),
        "{error}"
    );
}

#[test]
fn an_npz_array_of_wider_values_than_the_file_has_is_damaged() {
    for descr in
        ["|S9223372036854775807", "<U4611686018427387904", "|S100000000000", "|V18446744073709551615"]
    {
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (1,), }}\n");
        let error = refusal("wide.npz", &npz(&header, &[0; 16])).to_string();
        assert!(error.contains("array `t_s`"), "{descr}: {error}");
    }
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615,), }\n";
    assert!(refusal("many.npz", &npz(header, &[0; 16])).to_string().contains("damaged or cut off"));
}

#[test]
fn too_many_columns_are_refused_and_ten_thousand_are_read() {
    let table = |columns: usize| {
        let names: String = (2..columns).map(|k| format!(",c{k}_m")).collect();
        let row = |t: usize| format!("a,{t}{}\n", ",1".repeat(columns - 2));
        format!("trajectory,t_s{names}\n{}{}", row(0), row(1))
    };
    let error = refusal("wide.csv", table(100_000).as_bytes());
    assert!(matches!(&error, DataError::Limit { cause, .. } if cause.limit == Limit::Columns), "{error}");
    assert!(error.to_string().contains("wide.csv: has too many columns"), "{error}");
    // Also a row below an ordinary header.
    let row = format!("trajectory,t_s,x_m\na,0{}\n", ",".repeat(100_000));
    assert!(matches!(refusal("row.csv", row.as_bytes()), DataError::Limit { .. }));
    let most = file("most.csv", table(10_000).as_bytes());
    let data = read_dataset(&most.path, MissingCells::Refuse).expect("as many columns as are allowed");
    assert_eq!(data.columns().len(), 9_998);
}

#[test]
fn messages_do_not_repeat_long_or_hostile_cells() {
    let long = "9".repeat(1 << 20) + "x";
    let escapes = "\u{1b}[2J\u{1b}]0;title\u{7}\u{9b}31m";
    for content in [
        format!("trajectory,t_s,x_m\na,0,{long}\n"),
        format!("trajectory,t_s,x_m\na,0,{escapes}\n"),
        format!("trajectory,t_s,{long}\na,0,1\n"),
        format!("trajectory,t_s,{escapes}\na,0,1\n"),
        format!("{long},t_s,x_m\na,0,1\n"),
        format!("{escapes},t_s,x_m\na,0,1\n"),
        format!("trajectory,t_s,x_m,{escapes}\na,0,1\n"),
        format!("trajectory,t_s,x_m\n{long},0,1\n{long},0,1\n"),
        format!("trajectory,t_s,x_m\n{escapes},0,1\n"),
        format!("trajectory,group,t_s,x_m\na,{long},0,1\na,b,1,1\n"),
    ] {
        let error = refusal("cell.csv", content.as_bytes()).to_string();
        assert!(error.len() < 1500, "{} bytes: {}", error.len(), &error[..300]);
        assert!(!error.chars().any(char::is_control), "{error:?}");
    }
}

#[test]
fn a_stream_that_states_too_many_rows_is_refused() {
    let name = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000.h5";
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mit-push").join(name);
    let mut bytes = std::fs::read(fixture).expect("the fixture");
    // Offsets of the sizes of tables in data spaces: rows, then 4 columns, as little-endian 64-bit numbers.
    let columns = 4_u64.to_le_bytes();
    let extents: Vec<usize> = (0..bytes.len() - 16)
        .filter(|&k| bytes[k + 8..k + 16] == columns && (2..5000).contains(&little_endian(&bytes[k..k + 8])))
        .collect();
    assert!(!extents.is_empty(), "the fixture has tables");
    for k in extents {
        bytes[k..k + 8].copy_from_slice(&30_000_000_u64.to_le_bytes());
    }
    let stated = file(name, &bytes);
    let error = read_push_dataset(&stated.path).expect_err("the file is refused").to_string();
    assert!(error.contains("has too many samples") && error.contains("AUGSIM_LIMIT_SAMPLES"), "{error}");

    let rows = format!("{{\"tip_pose\": [{}[]]}}", "[],".repeat(1_000_001));
    let error = refusal("block=al_run=01.json", rows.as_bytes()).to_string();
    assert!(error.contains("stream `tip_pose` has too many samples"), "{error}");
}

fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
}

#[test]
fn resampling_at_any_rate_works_or_is_refused() {
    let trajectory = Trajectory::new("a", vec![0.0, 1.0, 2.0], vec![vec![0.0, 1.0, 4.0]]).unwrap();
    let set = Dataset::from_names(&["x_m"], vec![trajectory]).unwrap();
    for rate_hz in [1e300, 1e19, 1e7, f64::MAX] {
        let error = resample(&set, rate_hz).expect_err("too many samples").to_string();
        assert!(error.contains(" Hz the data set has too many samples"), "{error}");
    }
    for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(resample(&set, rate_hz).unwrap_err().to_string().contains("give a positive rate"));
    }
    for (rate_hz, samples) in [(1e-9, 1), (f64::MIN_POSITIVE, 1), (1e5, 200_001)] {
        assert_eq!(resample(&set, rate_hz).unwrap().trajectories()[0].len(), samples, "{rate_hz}");
    }
}
