//! Contract: the columns that a model names are read from a file or a folder of files, with the units of the
//! model.

use augsim_data::{DataError, Dataset, NamedCsv, Unit};
use std::fs;
use std::path::Path;

fn read(path: &Path) -> Result<Dataset, DataError> {
    let metre = Unit::parse("m").expect("a unit");
    NamedCsv::open(path)?.read(&[("x_m", metre)])
}

/// Makes a folder with the given files, as (name, content).
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, content) in files {
        fs::write(folder.path().join(name), content).expect("a file");
    }
    folder
}

#[test]
fn files_of_a_folder_are_trajectories_with_the_names_of_the_files() {
    let folder_of_files = folder(&[
        ("swing-2.csv", "t_s,x_m\n0,2\n0.5,2.5\n"),
        ("swing-1.csv", "t_s,other,x_m\n0,9,1\n0.1,9,1.5\n"),
        ("more.csv", "trajectory,t_s,x_m\na,0,3\na,1,3.5\nb,0,4\nb,1,4.5\n"),
        ("photograph.png", "no recording"),
    ]);
    let data = read(folder_of_files.path()).expect("a data set");
    let names: Vec<&str> = data.trajectories().iter().map(|t| t.id()).collect();
    assert_eq!(names, ["more/a", "more/b", "swing-1", "swing-2"]);
    let first: Vec<f64> = data.trajectories().iter().map(|t| t.column(0)[0]).collect();
    assert_eq!(first, [3.0, 4.0, 1.0, 2.0]);
    assert_eq!(data.path(), Some(folder_of_files.path()));
}

#[test]
fn a_single_file_is_one_trajectory() {
    let folder_of_files = folder(&[("swing.csv", "t_s,x_m\n0,2\n0.5,2.5\n")]);
    let data = read(&folder_of_files.path().join("swing.csv")).expect("a data set");
    assert_eq!(data.trajectories()[0].id(), "1");
}

#[test]
fn each_trajectory_can_be_a_group_of_its_own() {
    let folder_of_files = folder(&[
        ("swing.csv", "t_s,x_m\n0,2\n0.5,2.5\n"),
        ("more.csv", "trajectory,group,t_s,x_m\na,day,0,3\na,day,1,3.5\nb,day,0,4\nb,day,1,4.5\n"),
    ]);
    let read = |path: &Path| {
        let metre = Unit::parse("m").expect("a unit");
        NamedCsv::open(path)?.with_groups("trajectory")?.read(&[("x_m", metre)])
    };
    let groups = |data: &Dataset| -> Vec<Option<String>> {
        data.trajectories().iter().map(|t| t.group().map(str::to_owned)).collect()
    };
    let label = |label: &str| Some(label.to_owned());
    let all = read(folder_of_files.path()).expect("a data set");
    assert_eq!(groups(&all), ["more/a", "more/b", "swing"].map(label));
    let one_file = read(&folder_of_files.path().join("more.csv")).expect("a data set");
    assert_eq!(groups(&one_file), ["a", "b"].map(label));
}

#[test]
fn the_error_names_the_file_of_a_folder_that_lacks_a_column() {
    let folder_of_files =
        folder(&[("a.csv", "t_s,x_m\n0,2\n0.5,2.5\n"), ("b.csv", "t_s,y_m\n0,2\n0.5,2.5\n")]);
    let error = read(folder_of_files.path()).unwrap_err();
    assert!(matches!(error, DataError::MissingColumn { .. }), "{error}");
    assert!(error.to_string().contains("b.csv"), "{error}");
}

#[test]
fn the_error_for_a_folder_without_recordings_lists_the_extensions() {
    let folder_of_files = folder(&[("photograph.png", "no recording")]);
    let error = read(folder_of_files.path()).unwrap_err().to_string();
    assert!(error.contains("the folder has no recordings; add files that end in .csv"), "{error}");
}

#[test]
fn two_files_with_the_same_name_are_an_error() {
    let content = "t_s,x_m\n0,2\n0.5,2.5\n";
    let folder_of_files = folder(&[("a.csv", content), ("a.txt", content)]);
    let error = read(folder_of_files.path()).unwrap_err();
    assert!(matches!(error, DataError::DuplicateTrajectory { .. }), "{error}");
}
