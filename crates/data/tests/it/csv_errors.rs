//! Contract: the reader stops at the first fault of a file, and the message states where it is and what to
//! do. `F` is the path. The whole texts are asserted, because users see them.

use augsim_data::{DataError, Dataset, MissingCells, Trajectory, read_csv, read_legacy_ball, write_csv};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use std::path::PathBuf;

struct File {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn file(bytes: &[u8]) -> File {
    let folder = tempfile::tempdir().expect("a writable temporary folder");
    let path = folder.path().join("drops.csv");
    std::fs::write(&path, bytes).expect("a writable temporary folder");
    File { _folder: folder, path }
}

/// Message of an error, with the path of the file replaced by `F`.
fn text_of(error: &DataError, path: &std::path::Path) -> String {
    error.to_string().replace(&path.display().to_string(), "F")
}

/// Message of the error for a file with the content `content`.
fn refusal(content: &str) -> String {
    let file = file(content.as_bytes());
    let error = read_csv(&file.path, MissingCells::Refuse).expect_err("the file is faulty");
    text_of(&error, &file.path)
}

fn gzip(content: &str) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(content.as_bytes()).expect("a writable temporary folder");
    encoder.finish().expect("a writable temporary folder")
}

const HEADER: &str = "trajectory,t_s,height_m,velocity_m_s\n";

#[test]
fn a_folder_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let error = read_csv(folder.path(), MissingCells::Refuse).unwrap_err();
    assert!(matches!(error, DataError::Folder { .. }), "{error}");
    assert!(error.to_string().contains("put the recordings into one CSV file"), "{error}");
}

#[test]
fn a_missing_file_is_unreadable() {
    let path = PathBuf::from("no/such.csv");
    let error = read_csv(&path, MissingCells::Refuse).unwrap_err();
    assert!(matches!(error, DataError::Unreadable { .. }));
    assert!(error.to_string().starts_with("no/such.csv: there is no such file or folder"));
    assert!(error.to_string().ends_with("; check the path"));
}

#[test]
fn empty_files_and_headers_without_rows_are_errors() {
    let empty = "F: the file is empty; the first line must be a header such as \
                 `trajectory,t_s,height_m,velocity_m_s`";
    assert_eq!(refusal(""), empty);
    assert_eq!(refusal("\n\n"), empty);
    assert_eq!(
        refusal(HEADER),
        "F: line 1: the file has a header but no samples; add one row for each sample"
    );
    assert_eq!(
        refusal("trajectory,t_s,group\na,0,tennis\n"),
        "F: line 1: there is no column of measured values; add at least one whose name ends in its unit, \
         such as `height_m`"
    );
}

#[test]
fn missing_repeated_and_unitless_columns_are_errors() {
    assert_eq!(
        refusal("trajectory,time,height_m\na,0,1\n"),
        "F: line 1: column `t_s` is missing; the header has: trajectory, time, height_m; the long \
         form is comma-separated and starts with `trajectory,t_s,` followed by columns that end in \
         their unit"
    );
    assert_eq!(
        refusal("trajectory;t_s;height_m\na;0;1\n"),
        "F: line 1: cells are separated by ';'; save the file with commas between cells and points in \
         decimals (4.5, not 4,5)"
    );
    assert_eq!(
        refusal("trajectory,t_s,height_m,height_m\na,0,1,1\n"),
        "F: column `height_m` occurs twice; rename or remove one of them"
    );
    assert_eq!(
        refusal("trajectory,t_s,height_cm\na,0,1\n"),
        "F: line 1: column `height_cm`: the name does not end in a known unit; convert the values to SI and end the \
         name in one of _m _m2 _m3 _m_s _m_s2 _rad _rad_s _rad_s2 _s _Hz _kg _kg_m2 _N _N_m _Pa _K _V \
         _A _W _J _C _Ohm _mol, or a quotient of these with _per_, such as _per_s, _N_per_m or \
         _N_s_per_m; pure numbers end in new, flag, count, index, ratio, fraction, restitution, \
         friction; put text labels into a column called `group`"
    );
    assert_eq!(
        refusal("trajectory,t_s,height (m)\na,0,1\n"),
        "F: line 1: column `height (m)`: a column name may hold only ASCII letters, digits and underscores, must \
         start with a letter and be at most 256 characters long; rename it"
    );
}

#[test]
fn cells_that_are_not_finite_numbers_are_errors() {
    for cell in ["NaN", "inf", "-Infinity", "1e999", "n/a", "1,5,2", "0x10", "4.5 m"] {
        let quoted = format!("\"{cell}\"");
        assert_eq!(
            refusal(&format!("{HEADER}a,0,1,0\na,1,{quoted},0\n")),
            format!(
                "F: line 3, column `height_m`: `{cell}` is not a finite number; write a decimal \
                 such as 1.25 or -3e-4, and leave out samples that were not measured"
            )
        );
    }
    assert_eq!(
        refusal(&format!("{HEADER}a,soon,1,0\n")),
        "F: line 2, column `t_s`: `soon` is not a finite number; write a decimal such as 1.25 or \
         -3e-4, and leave out samples that were not measured"
    );
}

#[test]
fn empty_cells_are_errors_where_gaps_are_not_allowed() {
    assert_eq!(
        refusal(&format!("{HEADER}a,0,1,\n")),
        "F: line 2, column `velocity_m_s`: empty cell; every value is needed here: fill it in, or \
         remove the row or the trajectory"
    );
    let gaps = file(format!("{HEADER}a,0,1,\n,1,1,1\n").as_bytes());
    let error = read_csv(&gaps.path, MissingCells::AsGap).unwrap_err();
    assert_eq!(
        text_of(&error, &gaps.path),
        "F: line 3, column `trajectory`: empty cell; every row needs a value in this column"
    );
    let gaps = file(format!("{HEADER}a,,1,1\n").as_bytes());
    let error = read_csv(&gaps.path, MissingCells::AsGap).unwrap_err();
    assert_eq!(text_of(&error, &gaps.path), "F: line 2, column `t_s`: empty cell; every sample needs a time");
}

#[test]
fn rows_with_another_number_of_cells_are_errors() {
    let expected = |found, remedy| {
        format!(
            "F: line 3: the row has {found} cells but the header has 4; {remedy} (the first column is `trajectory`)"
        )
    };
    assert_eq!(refusal(&format!("{HEADER}a,0,1,0\na,1,1\n")), expected(3, "complete the row"));
    let points = "if decimals are written with commas, write them with points (4.5, not 4,5); otherwise \
                  remove the extra cells";
    assert_eq!(refusal(&format!("{HEADER}a,0,1,0\na,1,1,0,7\n")), expected(5, points));
    let surplus = "remove the extra cells, or put cells that contain a comma in double quotes";
    assert_eq!(refusal(&format!("{HEADER}a,0,1,0\na,1.5,1,x,\n")), expected(5, surplus));
}

#[test]
fn times_that_do_not_increase_are_errors() {
    assert_eq!(
        refusal(&format!("{HEADER}a,0,1,0\na,0.5,1,0\na,0.25,1,0\n")),
        "F: line 4, column `t_s`: the time of trajectory `a` does not increase (0.25 s follows 0.5 s); sort its rows \
         by time and remove repeated times"
    );
    assert_eq!(
        refusal(&format!("{HEADER}a,0,1,0\nb,3,1,0\nb,3,1,0\n")),
        "F: line 4, column `t_s`: the time of trajectory `b` does not increase (3 s follows 3 s); sort its rows by \
         time and remove repeated times"
    );
}

#[test]
fn rows_of_a_trajectory_that_are_not_contiguous_are_an_error() {
    assert_eq!(
        refusal(&format!("{HEADER}a,0,1,0\nb,0,1,0\n\na,1,1,0\n")),
        "F: line 5, column `trajectory`: trajectory `a` appears again after it ended on line 2; \
         keep its rows together or give the second part another name"
    );
}

#[test]
fn changing_groups_and_invalid_labels_are_errors() {
    assert_eq!(
        refusal("trajectory,group,t_s,height_m\na,golf,0,1\na,tennis,1,1\n"),
        "F: line 3, column `group`: the group of trajectory `a` changes from `golf` to `tennis`; give all rows of a \
         trajectory the same group"
    );
    assert_eq!(
        refusal(&format!("{HEADER}\"a\nb\",0,1,0\n")),
        "F: line 2, column `trajectory`: \"a\\nb\" begins or ends with a space, contains a \
         control character or is longer than 256 bytes; rename it"
    );
}

#[test]
fn bytes_that_are_not_utf8_are_an_error() {
    let file = file(b"trajectory,t_s,height_m\na,0,1\n\xff\xfe,1,1\n");
    let error = read_csv(&file.path, MissingCells::Refuse).unwrap_err();
    assert_eq!(
        text_of(&error, &file.path),
        "F: line 3, column `trajectory`: not UTF-8 text; save the file as UTF-8"
    );
}

#[test]
fn truncated_and_damaged_gzip_streams_are_errors() {
    let rows: String = (0..2000).map(|i| format!("a,{i},{},0\n", (i * 7919) % 1013)).collect();
    let whole = gzip(&format!("{HEADER}{rows}"));
    let intact = file(&whole);
    let samples = read_csv(&intact.path, MissingCells::Refuse).unwrap();
    assert_eq!(samples.trajectories()[0].len(), 2000);

    // Cut anywhere: in the gzip header, in the data, in the final checksum.
    for kept in [3, whole.len() / 2, whole.len() - 4] {
        let cut = file(&whole[..kept]);
        let error = read_csv(&cut.path, MissingCells::Refuse).unwrap_err();
        let DataError::TruncatedGzip { line, .. } = error else { panic!("{kept}: {error}") };
        assert_eq!(
            text_of(&error, &cut.path),
            format!(
                "F: line {line}: the gzip stream ends too early; the file was cut off while \
                 copying or writing: copy or make it again"
            )
        );
    }

    let mut flipped = whole.clone();
    let checksum = flipped.len() - 8;
    flipped[checksum] ^= 1;
    let damaged = file(&flipped);
    let error = read_csv(&damaged.path, MissingCells::Refuse).unwrap_err();
    assert!(matches!(error, DataError::DamagedGzip { .. }), "{error}");
}

#[test]
fn errors_in_the_ball_layout_name_its_columns() {
    let long = file(format!("{HEADER}a,0,1,0\n").as_bytes());
    let error = read_legacy_ball(&long.path).unwrap_err();
    assert_eq!(
        text_of(&error, &long.path),
        "F: line 1: column `traj` is missing; the header has: trajectory, t_s, height_m, \
         velocity_m_s; the ball layout is `traj,step,t,height,velocity`"
    );
    let gap = file(b"traj,step,t,height,velocity\n0,0,0,4,\n");
    let error = read_legacy_ball(&gap.path).unwrap_err();
    assert_eq!(
        text_of(&error, &gap.path),
        "F: line 2, column `velocity`: empty cell; this layout does not allow empty cells; fill it in, or remove the row"
    );
    let half = file(b"traj,step,t,height,velocity\n0,0.5,0,4,1\n");
    assert!(read_legacy_ball(&half.path).unwrap_err().to_string().contains("column `step`"));
}

#[test]
fn data_sets_built_by_code_are_checked() {
    let trajectory = |id: &str| Trajectory::new(id, vec![0.0, 1.0], vec![vec![1.0, 2.0]]);
    let text = |result: Result<Trajectory, DataError>| result.unwrap_err().to_string();
    assert_eq!(text(Trajectory::new("a", vec![], vec![])), "trajectory `a` has no samples; leave it out");
    assert_eq!(
        text(Trajectory::new("a", vec![0.0, 0.0], vec![])),
        "trajectory `a`: the time of sample 1 is not finite or not greater than the one before; times must increase \
         strictly"
    );
    assert_eq!(
        text(Trajectory::new("a", vec![0.0, 1.0], vec![vec![1.0]])),
        "trajectory `a`: value column 0 has 1 samples but there are 2 times; pass one value for each time"
    );
    assert_eq!(
        text(Trajectory::new("a", vec![0.0], vec![vec![f64::NEG_INFINITY]])),
        "trajectory `a`: value column 0 is infinite at sample 0; only finite values, and NaN for a \
         gap, are allowed"
    );
    assert_eq!(
        text(trajectory(" a")),
        "trajectory \" a\": identifiers and groups must not be empty, begin or end with a space, \
         contain control characters or be longer than 256 bytes; rename it"
    );

    let text = |result: Result<Dataset, DataError>| result.unwrap_err().to_string();
    let two = || vec![trajectory("a").unwrap(), trajectory("b").unwrap()];
    assert_eq!(
        text(Dataset::from_names(&["x_m", "y_m"], two())),
        "data set in memory: trajectory `a` has 1 value columns but the data set has 2; pass one vector for each column"
    );
    assert_eq!(
        text(Dataset::from_names(&["x_m"], vec![trajectory("a").unwrap(), trajectory("a").unwrap()])),
        "data set in memory: trajectory `a` occurs twice; give each trajectory a different name"
    );
    let mixed = vec![trajectory("a").unwrap(), trajectory("b").unwrap().with_group("g").unwrap()];
    assert_eq!(
        text(Dataset::from_names(&["x_m"], mixed)),
        "data set in memory: trajectory `b` has a group but the first trajectory has none; give a group to all \
         trajectories or to none"
    );
    assert_eq!(
        text(Dataset::from_names(&["t_s"], vec![])),
        "column `t_s`: the names `trajectory`, `t_s` and `group` are reserved; rename it"
    );

    let set = Dataset::from_names(&["x_m"], two()).unwrap().with_path("drops.csv");
    assert_eq!(
        set.column_index("height_m").unwrap_err().to_string(),
        "drops.csv: there is no column `height_m`; the columns are: x_m; rename a column or use one of these"
    );
    let nothing = write_csv(&set.select(&[]), &PathBuf::from("out.csv")).unwrap_err();
    assert_eq!(
        nothing.to_string(),
        "out.csv: a data set without trajectories is not written, because no reader would accept it; keep at least one"
    );
}
