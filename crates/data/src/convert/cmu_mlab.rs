//! Converter of `cmu-mlab`: random one-step pushes with force (Zhou et al., ICRA 2016).
//!
//! The rod and the force are recorded during a push, the object only before and after it. The rod is logged
//! at about 33 Hz, the force at 100 Hz. The two-finger runs in the same folder are not read: they are pushes
//! with line contact, for which there is no model.

use super::Converted;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::push::union_clock::{Source, union};
use crate::push::{PlanarPose, PushError, TRIAL_COLUMNS};
use crate::trajectory::Trajectory;
use crate::whole_file::read_log;
use std::f64::consts::{FRAC_PI_4, TAU};
use std::fs;
use std::path::{Path, PathBuf};

const EXPECTED: &str = "`sensor_log/*.txt`, or those files themselves";
/// Centroid of the triangle (legs of 150 mm) relative to the logged right-angle corner, m.
const CENTROID_M: [f64; 2] = [0.05, 0.05];
/// Maximum interval between samples of rod or force that is interpolated, s.
///
/// The object is not interpolated.
const MAX_INTERPOLATED_S: f64 = 0.5;

/// Model file of the pushed aluminium triangle.
///
/// c is that of uniform pressure on the full face, although some runs support it on pins; friction is from
/// the paper.
const MODEL: &str = "\
scenario = \"push\"
polygon_m = [[-0.05, -0.05], [0.10, -0.05], [-0.05, 0.10]]

[parameters]
c_m = { nominal = 0.0452, min = 0.005, max = 0.15 }
contact_friction = { nominal = 0.5, min = 0.0, max = 1.0 }
rod_radius_m = { nominal = 0.001, frozen = true }
support_friction = { nominal = 0.3, frozen = true }
mass_kg = { nominal = 1.518, frozen = true }

[sensor]
position_sd_m = 0.001
angle_sd_rad = 0.005
";

/// Converts the logs in a folder or in its `sensor_log`, or one log; the group is surface and support.
pub(super) fn convert(path: &Path) -> Result<Converted, DataError> {
    let mut trajectories = Vec::new();
    for file in logs(path)? {
        let text = read_log(&file)?;
        let mut log = Log { path: &file, lines: text.lines(), line: 0 };
        let [count] = log.numbers("the number of pushes")?;
        let (name, group) = names(&file);
        for push in 0..count as usize {
            let trajectory = log.push(format!("{name}/{push:02}"))?;
            trajectories.push(trajectory.with_group(group.clone())?);
        }
    }
    let data = Dataset::from_names(&TRIAL_COLUMNS, trajectories)?.with_path(path);
    Ok(Converted { data, model_toml: Some(MODEL.to_owned()) })
}

/// Log files in a folder, sorted by name, or the one log file `path`.
fn logs(path: &Path) -> Result<Vec<PathBuf>, DataError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let inner = path.join("sensor_log");
    let folder = if inner.is_dir() { inner } else { path.to_owned() };
    let unreadable = |cause| DataError::Unreadable { path: folder.clone(), cause };
    let mut files = Vec::new();
    for entry in fs::read_dir(&folder).map_err(unreadable)? {
        files.push(entry.map_err(unreadable)?.path());
    }
    files.retain(|file| file.extension().is_some_and(|e| e == "txt"));
    files.sort_unstable();
    match files.is_empty() {
        true => Err(PushError::NoPushFiles { path: folder, expected: EXPECTED }.into()),
        false => Ok(files),
    }
}

/// Short name of a log and its group (`surface/support`), both from the file name.
///
/// `wood_30_90_30_30_30_90__exp_…` is plywood and a support by three pins at x 30, 90, 30 and y 30, 30, 90 mm.
fn names(file: &Path) -> (String, String) {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let head = stem.split("__").next().unwrap_or(&stem).to_owned();
    let (surface, support) = match head.strip_prefix("wood_") {
        Some(support) => ("plywood", support),
        None => ("hardboard", head.as_str()),
    };
    let group = format!("{surface}/{support}");
    (head, group)
}

/// A log file that is being read line by line.
struct Log<'a> {
    path: &'a Path,
    lines: std::str::Lines<'a>,
    line: usize,
}

impl Log<'_> {
    /// Creates the error for a line of the log that does not hold `expected`.
    fn error(&self, expected: &'static str) -> PushError {
        PushError::Log { path: self.path.to_owned(), line: self.line, expected }
    }

    /// Reads the next line as `N` finite numbers; `expected` describes them in the error.
    fn numbers<const N: usize>(&mut self, expected: &'static str) -> Result<[f64; N], PushError> {
        self.line += 1;
        let text = self.lines.next().ok_or_else(|| self.error(expected))?;
        let mut numbers = [0.0; N];
        let mut cells = text.split_whitespace();
        for number in &mut numbers {
            *number = cells
                .next()
                .and_then(|cell| cell.parse::<f64>().ok())
                .filter(|v| v.is_finite())
                .ok_or_else(|| self.error(expected))?;
        }
        match cells.next() {
            None => Ok(numbers),
            Some(_) => Err(self.error(expected)),
        }
    }

    /// Reads a number of rows and the rows themselves, which begin with a time.
    ///
    /// A row with the same time as the one before is left out (the time stamps of the robot repeat at the end
    /// of a push); an earlier time is an error.
    fn rows<const N: usize>(
        &mut self,
        count: &'static str,
        row: &'static str,
    ) -> Result<Vec<[f64; N]>, PushError> {
        let [rows] = self.numbers(count)?;
        let mut out: Vec<[f64; N]> = Vec::new();
        for _ in 0..rows as usize {
            let next = self.numbers(row)?;
            if out.last().is_some_and(|last| next[0] < last[0]) {
                return Err(self.error("a later time"));
            }
            if out.last().is_none_or(|last| next[0] > last[0]) {
                out.push(next);
            }
        }
        match out.len() < 2 {
            true => Err(self.error("at least two samples")),
            false => Ok(out),
        }
    }

    /// Reads one push as a trajectory on the union of the clocks of rod and force.
    fn push(&mut self, id: String) -> Result<Trajectory, DataError> {
        const POSE: &str = "a pose of seven numbers";
        let before = centroid(self.numbers(POSE)?);
        let mut after = centroid(self.numbers(POSE)?);
        after.theta_rad -= ((after.theta_rad - before.theta_rad) / TAU).round() * TAU;
        let force: Vec<[f64; 3]> =
            self.rows("the number of force samples", "a force sample of three numbers")?;
        let rod: Vec<[f64; 8]> =
            self.rows("the number of robot samples", "a robot sample of eight numbers")?;

        let start_s = force[0][0].max(rod[0][0]);
        let end_s = force[force.len() - 1][0].min(rod[rod.len() - 1][0]);
        let tool = yaw(rod[0][4], rod[0][5], rod[0][6], rod[0][7]);
        // The y axis of the sensor is mirrored, and the sensor is turned by 45 degrees relative to the tool.
        // The first sample, before contact, is its offset. The sign is that of the force on the rod.
        let to_world = PlanarPose { theta_rad: tool + FRAC_PI_4, ..PlanarPose::default() };
        let forces: Vec<[f64; 2]> =
            force.iter().map(|f| to_world.rotate([f[1] - force[0][1], force[0][2] - f[2]])).collect();

        let stream = |time_s: Vec<f64>, columns: Vec<Vec<f64>>, max_interpolated| Source {
            time_s: time_s.into_iter().map(|t| t - start_s).collect(),
            angular: (0..columns.len()).map(|i| i == 2).collect(),
            columns,
            max_interpolated_s: max_interpolated,
        };
        let sources = [
            stream(
                rod.iter().map(|r| r[0]).collect(),
                vec![
                    rod.iter().map(|r| r[1] / 1000.0).collect(),
                    rod.iter().map(|r| r[2] / 1000.0).collect(),
                ],
                MAX_INTERPOLATED_S,
            ),
            stream(
                vec![start_s, end_s],
                vec![
                    vec![before.x_m, after.x_m],
                    vec![before.y_m, after.y_m],
                    vec![before.theta_rad, after.theta_rad],
                ],
                0.0,
            ),
            stream(
                force.iter().map(|f| f[0]).collect(),
                vec![forces.iter().map(|f| f[0]).collect(), forces.iter().map(|f| f[1]).collect()],
                MAX_INTERPOLATED_S,
            ),
        ];
        let joined = union(&sources).ok_or_else(|| PushError::NoCommonTime { path: self.path.to_owned() })?;
        Trajectory::new(id, joined.time_s, [joined.columns, joined.fresh].concat())
    }
}

/// Pose of the triangle's centroid from a logged pose of its corner: `x y z`, mm, and quaternion `w x y z`.
fn centroid([x, y, _, w, i, j, k]: [f64; 7]) -> PlanarPose {
    let corner = PlanarPose { x_m: x / 1000.0, y_m: y / 1000.0, theta_rad: yaw(w, i, j, k) };
    let [x_m, y_m] = corner.point(CENTROID_M);
    PlanarPose { x_m, y_m, ..corner }
}

/// Rotation about z of the quaternion w + i x + j y + k z, rad.
fn yaw(w: f64, i: f64, j: f64, k: f64) -> f64 {
    (2.0 * (w * k + i * j)).atan2(1.0 - 2.0 * (j * j + k * k))
}
