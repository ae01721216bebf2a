//! Contract: the published push files are read from HDF5, JSON and zip archives. Every measured sample is
//! exact, on the union of the three clocks and flagged, and poses are those of the area centroid. Resampling
//! is linear and never extrapolates, and NPZ reads back as it was written.
//!
//! The reference is a generated trajectory in `fixtures/mit-push`, and published figures of the measured
//! files.

use crate::shared_data::{shared_data, workspace};
use augsim_data::convert::CONVERTERS;
use augsim_data::push::{
    PlanarPose, PushShape, PushTrial, Surface, TrialName, in_start_frame, read_push_dataset,
    read_push_trials, resample,
};
use augsim_data::{Dataset, MissingCells, Summary, Trajectory, read_dataset, write_dataset};
use std::io::Write;
use std::path::{Path, PathBuf};

const NAME: &str = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000";

fn fixture(name: &str) -> PathBuf {
    workspace().join("fixtures/mit-push").join(name)
}

fn column<'a>(data: &Dataset, t: &'a Trajectory, name: &str) -> &'a [f64] {
    t.column(data.column_index(name).expect("a push column"))
}

/// Rows `[t, tip_x, tip_y, obj_x, obj_y, obj_th, fd_x, fd_y]` of the generated trajectory.
fn truth() -> Vec<[f64; 8]> {
    let text = std::fs::read_to_string(fixture("truth.csv")).expect("a fixture");
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect();
        [0, 1, 2, 3, 4, 5, 17, 18].map(|i| cells[i])
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn hdf5_samples_are_exact_on_the_union_of_the_clocks() {
    let data = read_push_dataset(&fixture("")).unwrap();
    let truth = truth();
    // Two files with the same numbers: the plain format, and the newest one with compression.
    assert_eq!(data.trajectories().len(), 2);
    assert_eq!(data.trajectories()[0].values(), data.trajectories()[1].values());
    let t = &data.trajectories()[0];
    assert_eq!((t.id(), t.group()), (NAME, Some("abs/tri1")));
    // The object begins on row 1 and ends on row 149, the force ends on row 150.
    assert_eq!(t.len(), 149);
    let get = |name| column(&data, t, name);
    for (k, row) in truth[1..150].iter().enumerate() {
        // Epoch times of 1.46e9 s are spaced by 2.4e-7 s.
        assert!((t.time_s()[k] - (row[0] - truth[1][0])).abs() < 5e-7);
        assert_eq!([get("pusher_x_m")[k], get("pusher_y_m")[k]], [row[1], row[2]]);
        let (fresh, force) = (get("object_new")[k], get("force_new")[k]);
        assert_eq!((get("pusher_new")[k], fresh), (1.0, if k % 2 == 0 { 1.0 } else { 0.0 }));
        assert_eq!(force, if (k + 1) % 3 == 0 { 1.0 } else { 0.0 });
        if fresh == 1.0 {
            // The transformation to the tracked frame and back has a few rounding errors of 0.1 m.
            assert!(
                (get("x_m")[k] - row[3]).abs() < 1e-16 * 8.0 && (get("y_m")[k] - row[4]).abs() < 1e-16 * 8.0
            );
            assert_eq!(get("theta_rad")[k], row[5]);
        }
        if force == 1.0 {
            assert_eq!([get("force_x_N")[k], get("force_y_N")[k]], [-2.0 * row[6], -2.0 * row[7]]);
        }
    }
}

#[test]
fn resampling_is_linear_and_does_not_extrapolate() {
    let data = read_push_dataset(&fixture(&format!("{NAME}.h5"))).unwrap();
    let on_grid = resample(&data, 40.0).unwrap();
    let (union, grid) = (&data.trajectories()[0], &on_grid.trajectories()[0]);
    assert!(!on_grid.has_column("object_new"));
    assert!(grid.time_s().last() <= union.time_s().last());
    assert_eq!(grid.len(), 1 + (7.4 * 40.0) as usize);
    let (x, samples) = (column(&on_grid, grid, "pusher_x_m"), column(&data, union, "pusher_x_m"));
    // The rod moves uniformly, so linear interpolation is exact except for the time stamps (2.4e-7 s at 0.02
    // m/s).
    for (time, value) in grid.time_s().iter().zip(x) {
        let expected = samples[0] + (samples[148] - samples[0]) * time / 7.4;
        assert!((value - expected).abs() < 2e-8, "{value} {expected}");
    }
    assert!(resample(&data, 0.0).unwrap_err().to_string().contains("positive rate"));
}

#[test]
fn a_push_in_its_start_frame_begins_at_the_origin_and_keeps_distances() {
    let data = resample(&read_push_dataset(&fixture(&format!("{NAME}.h5"))).unwrap(), 20.0).unwrap();
    let moved = in_start_frame(&data).unwrap();
    let (a, b) = (&data.trajectories()[0], &moved.trajectories()[0]);
    let gap = |d: &Dataset, t: &Trajectory, k: usize| {
        let value = |name| column(d, t, name)[k];
        (value("pusher_x_m") - value("x_m")).hypot(value("pusher_y_m") - value("y_m"))
    };
    assert_eq!([column(&moved, b, "x_m")[0], column(&moved, b, "theta_rad")[0]], [0.0, 0.0]);
    for k in 0..a.len() {
        assert!((gap(&data, a, k) - gap(&moved, b, k)).abs() < 1e-15);
        let force = column(&moved, b, "force_x_N")[k].hypot(column(&moved, b, "force_y_N")[k]);
        let recorded = column(&data, a, "force_x_N")[k].hypot(column(&data, a, "force_y_N")[k]);
        assert!((force - recorded).abs() < 1e-14);
    }
}

#[test]
fn zip_archives_read_like_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tri1_h5.zip");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    archive.add_directory("tri1_h5", zip::write::SimpleFileOptions::default()).unwrap();
    archive.start_file(format!("tri1_h5/{NAME}.h5"), zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(&std::fs::read(fixture(&format!("{NAME}.h5"))).unwrap()).unwrap();
    archive.finish().unwrap();
    let (zipped, plain) =
        (read_dataset(&path, MissingCells::Refuse).unwrap(), fixture(&format!("{NAME}.h5")));
    assert_eq!(zipped.trajectories(), read_push_dataset(&plain).unwrap().trajectories());

    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let error = read_push_trials(&path).unwrap_err().to_string();
    assert!(error.starts_with(&path.display().to_string()), "{error}");
    assert!(
        error.contains("zip archive is damaged or cut off") && error.contains("download it again"),
        "{error}"
    );
}

#[test]
fn file_names_are_parsed_and_written_back() {
    let name = "motion_surface=pu_shape=butter_a=2500_v=-1_i=0.000_s=0.975_t=-1.396_rep=0012";
    let parsed = TrialName::parse(Path::new(&format!("somewhere/{name}.h5"))).unwrap();
    let TrialName::Motion(m) = parsed else { panic!("a trial of the set") };
    assert_eq!((m.surface, m.shape, m.side, m.repeat), (Surface::Pu, PushShape::Butter, 0, Some(12)));
    assert_eq!((m.acceleration_m_s2, m.speed_m_s, m.angle_rad), (2.5, None, -1.396));
    assert_eq!(parsed.to_string(), name);
    assert_eq!(TrialName::parse(Path::new(name)).unwrap(), parsed);
    for name in [NAME, "block=plastic_run=00"] {
        assert_eq!(TrialName::parse(Path::new(name)).unwrap().to_string(), name);
    }
}

#[test]
fn npz_reads_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let (one, two) = (folder.path().join("one.npz"), folder.path().join("two.npz"));
    let data = read_push_dataset(&fixture("")).unwrap();
    write_dataset(&data, &one).unwrap();
    let back = read_dataset(&one, MissingCells::Refuse).unwrap();
    assert_eq!((back.columns(), back.trajectories()), (data.columns(), data.trajectories()));
    write_dataset(&back, &two).unwrap();
    assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&two).unwrap(), "equal sets, equal bytes");

    let gap = Trajectory::new("ä 1", vec![0.0, 1.0], vec![vec![1.5, f64::NAN]]).unwrap();
    write_dataset(&Dataset::from_names(&["x_m"], vec![gap]).unwrap(), &one).unwrap();
    let back = read_dataset(&one, MissingCells::AsGap).unwrap();
    assert_eq!(back.trajectories()[0].id(), "ä 1");
    assert!(back.trajectories()[0].column(0)[1].is_nan());
    let error = read_dataset(&one, MissingCells::Refuse).unwrap_err().to_string();
    assert!(error.contains("line 2, column `x_m`: `NaN`"), "{error}");

    let whole = std::fs::read(&one).unwrap();
    std::fs::write(&one, &whole[..whole.len() - 30]).unwrap();
    let error = read_dataset(&one, MissingCells::AsGap).unwrap_err().to_string();
    assert!(error.contains("one.npz") && error.contains("cut off"), "{error}");
}

#[test]
fn the_official_trial_has_its_published_figures() {
    let Some(folder) = shared_data("mit-pnpush-pushes/official") else { return };
    let trials = read_push_trials(&folder).unwrap();
    let [trial] = &trials[..] else { panic!("one trial") };
    let rows = [trial.tip.len(), trial.object.len(), trial.wrench.len()];
    assert_eq!(rows, [205, 207, 206]);
    let end = |c: usize| trial.object.values[c][206] - trial.object.values[c][0];
    // Displacement and rotation as in the description of the set, to its last digit.
    for (value, stated, digit) in [(end(0), -0.0313, 1e-4), (end(1), 0.0281, 1e-4), (end(2), -0.589, 1e-3)] {
        assert!((value - stated).abs() < digit, "{value} {stated}");
    }
    assert!((trial.start_s - 1_460_088_637.23).abs() < 0.01);
    let TrialName::Motion(m) = trial.name else { panic!("a trial of the set") };
    assert_eq!((m.surface, m.shape, m.speed_m_s), (Surface::Plywood, PushShape::Hex, Some(0.15)));
    // In contact the centre of the rod is at a distance of its radius, 4.75 mm, from the hexagon
    // (circumradius 60.5 mm), with an error of 0.5 mm of the motion capture. At a speed of 150 mm/s the
    // offset of up to 10 ms between the clocks of robot and motion capture adds 1.5 mm.
    let data = read_push_dataset(&folder).unwrap();
    let t = &data.trajectories()[0];
    let get = |name| column(&data, t, name);
    for k in 0..t.len() {
        let pose = PlanarPose { x_m: get("x_m")[k], y_m: get("y_m")[k], theta_rad: get("theta_rad")[k] };
        let [x, y] = pose.point_back([get("pusher_x_m")[k], get("pusher_y_m")[k]]);
        let face = |side: u32| (f64::from(30 + 60 * side)).to_radians();
        let outside = (0..6).map(|side| x * face(side).cos() + y * face(side).sin()).fold(f64::MIN, f64::max);
        let gap = outside - 0.0605 * 0.75_f64.sqrt();
        let moving = (0.15..0.55).contains(&t.time_s()[k]);
        let allowed = if moving { 0.0005 + 0.0015 } else { 0.0005 };
        assert!((gap - 0.00475).abs() < allowed, "{gap} at {} s", t.time_s()[k]);
    }
}

#[test]
fn repeats_and_confused_poses_of_preliminary_pushes_are_removed() {
    let Some(folder) = shared_data("mit-pnpush-pushes/preliminary") else { return };
    let trials = read_push_trials(&folder).unwrap();
    assert_eq!(trials.len(), 22);
    // One pose of one trial is turned by 89 degrees between two good ones.
    let confused: Vec<&PushTrial> = trials.iter().filter(|t| t.removed_poses > 0).collect();
    assert_eq!(confused.len(), 1);
    assert_eq!(
        (confused[0].name.to_string().as_str(), confused[0].removed_poses),
        ("block=plastic_run=01", 1)
    );
    for trial in &trials {
        // The pose of the tool is logged at about twice the rate at which it is measured.
        let fresh = trial.tip.without_repeats().len() as f64 / trial.tip.len() as f64;
        assert!((0.4..0.8).contains(&fresh), "{}: {fresh}", trial.name);
    }
}

/// Converts a set in its folder of the shared data; `None` where the folder does not exist.
fn converted(set: &str, folder: &str) -> Option<Dataset> {
    let path = shared_data(folder)?;
    let (_, convert) = CONVERTERS.iter().find(|(name, _)| *name == set).expect("a converter");
    Some(convert(&path).expect("convertible").data)
}

#[test]
fn converted_slider_runs_have_no_gaps_and_plausible_rates() {
    let Some(data) = converted("mit-pusher-slider", "mit-pusher-slider-runs") else { return };
    for t in data.trajectories() {
        let get = |name| column(&data, t, name);
        for (new, name) in [("pusher_new", "pusher_x_m"), ("object_new", "x_m")] {
            assert_eq!((get(new).len(), get(name).iter().any(|v| v.is_nan())), (t.len(), false));
        }
        // An object that is pushed at 50 mm/s and knocked by hand moves less than 10 mm between two rows.
        assert!(get("x_m").windows(2).all(|w| (w[1] - w[0]).abs() < 0.01), "{}", t.id());
        assert_eq!(t.time_s()[0], 0.0);
    }
    let streams = Summary::from_dataset(&data).streams;
    let rates: Vec<_> = streams.iter().map(|s| (s.name.as_str(), s.median_rate_hz.unwrap_or(0.0))).collect();
    assert!(
        matches!(rates[..], [("pusher", a), ("object", b)] if (a - 250.0).abs() < 5.0 && (b - 250.0).abs() < 5.0)
    );
}

#[test]
fn converted_triangle_pushes_agree_with_the_published_table() {
    let Some(data) = converted("cmu-mlab", "cmu-mlab-pushes") else { return };
    let Some(table) = shared_data("cmu-mlab-pushes/pushes.csv") else { return };
    let table = std::fs::read_to_string(table).unwrap();
    let mut opposing = 0;
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>().unwrap();
        let log = cells[2].trim_start_matches("sensor_log/").split("__").next().unwrap();
        let id = format!("{log}/{:02}", number(3) as u32);
        let t = data.trajectories().iter().find(|t| t.id() == id).unwrap();
        let get = |name| column(&data, t, name);
        let last = t.len() - 1;
        // The table neglects the tilt of the pose, which is at most 0.2 mm, and is rounded to 1e-6 m and rad.
        for (value, cell) in
            [(get("x_m")[0], 4), (get("y_m")[0], 5), (get("x_m")[last], 7), (get("y_m")[last], 8)]
        {
            assert!((value - number(cell)).abs() < 2e-4, "{id}: {value} {}", number(cell));
        }
        // The table has the force on the object, which is opposite to that on the rod, within a few degrees.
        let mean = |name| get(name).iter().sum::<f64>() / t.len() as f64;
        let (a, b) = ([mean("force_x_N"), mean("force_y_N")], [number(15), number(16)]);
        let cosine = (a[0] * b[0] + a[1] * b[1]) / (a[0].hypot(a[1]) * b[0].hypot(b[1]));
        assert!(cosine < -0.99, "{id}: {cosine}");
        // The force opposes the motion of the rod.
        let rod = ["pusher_x_m", "pusher_y_m"].map(|n| get(n)[last] - get(n)[0]);
        opposing += usize::from(rod[0] * a[0] + rod[1] * a[1] < 0.0);
    }
    assert_eq!(opposing, 500);
}
