//! Contract: of a file or a folder of files the columns that a model names are read, with the model's units.

use augsim_data::{DataError, Dataset, NamedCsv, Unit};
use std::fs;
use std::path::Path;

fn read(path: &Path) -> Result<Dataset, DataError> {
    let metre = Unit::of_text("m").expect("a unit");
    NamedCsv::open(path)?.read(&[("x_m", metre)])
}

/// A folder of files with these contents.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, content) in files {
        fs::write(folder.path().join(name), content).expect("a file");
    }
    folder
}

#[test]
fn files_of_a_folder_are_trajectories_called_as_they_are() {
    let there = folder(&[
        ("swing-2.csv", "t_s,x_m\n0,2\n0.5,2.5\n"),
        ("swing-1.csv", "t_s,other,x_m\n0,9,1\n0.1,9,1.5\n"),
        ("more.csv", "trajectory,t_s,x_m\na,0,3\na,1,3.5\nb,0,4\nb,1,4.5\n"),
        ("photograph.png", "no recording"),
    ]);
    let data = read(there.path()).expect("a data set");
    let names: Vec<&str> = data.trajectories().iter().map(|t| t.id()).collect();
    assert_eq!(names, ["more/a", "more/b", "swing-1", "swing-2"]);
    let first: Vec<f64> = data.trajectories().iter().map(|t| t.column(0)[0]).collect();
    assert_eq!(first, [3.0, 4.0, 1.0, 2.0]);
    assert_eq!(data.path(), Some(there.path()));
}

#[test]
fn a_file_alone_is_one_trajectory() {
    let there = folder(&[("swing.csv", "t_s,x_m\n0,2\n0.5,2.5\n")]);
    let data = read(&there.path().join("swing.csv")).expect("a data set");
    assert_eq!(data.trajectories()[0].id(), "1");
}

#[test]
fn the_file_of_a_folder_that_lacks_a_column_is_named() {
    let there = folder(&[("a.csv", "t_s,x_m\n0,2\n0.5,2.5\n"), ("b.csv", "t_s,y_m\n0,2\n0.5,2.5\n")]);
    let error = read(there.path()).unwrap_err();
    assert!(matches!(error, DataError::MissingColumn { .. }), "{error}");
    assert!(error.to_string().contains("b.csv"), "{error}");
}

#[test]
fn a_folder_without_recordings_says_how_they_end() {
    let there = folder(&[("photograph.png", "no recording")]);
    let error = read(there.path()).unwrap_err().to_string();
    assert!(error.contains("the folder holds no recordings; they end in .csv"), "{error}");
}

#[test]
fn two_files_of_one_name_are_told() {
    let content = "t_s,x_m\n0,2\n0.5,2.5\n";
    let there = folder(&[("a.csv", content), ("a.txt", content)]);
    let error = read(there.path()).unwrap_err();
    assert!(matches!(error, DataError::DuplicateTrajectory { .. }), "{error}");
}
