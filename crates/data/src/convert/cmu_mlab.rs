//! `cmu-mlab`: random one-step pushes with force (Zhou, Paolini, Bagnell and Mason, ICRA 2016).
//!
//! The rod and the force are recorded during a push, the object only before and after it. The rod is logged at
//! about 33 Hz, the force at 100 Hz. Of the two-finger runs in the same folder nothing is read: they are pushes
//! along a line, for which there is no model.

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
/// The logged origin is the right-angle corner; the centroid lies at a third of both legs of 150 mm, m.
const CENTROID_M: [f64; 2] = [0.05, 0.05];
/// How far apart two samples of rod or force may be interpolated, s; the object's two poses are never.
const LONGEST_BRIDGE_S: f64 = 0.5;

/// The aluminium triangle: c of a uniform pressure on its full face (the pins differ), the authors' friction.
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

/// Reads the logs in the set's folder, in its `sensor_log`, or one log; `group` is surface and support.
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
        true => Err(PushError::Nothing { path: folder, expected: EXPECTED }.into()),
        false => Ok(files),
    }
}

/// Short name of a log, and its surface and support: `wood_30_90_30_30_30_90__exp_…` is plywood on three pins
/// at x 30, 90, 30 and y 30, 30, 90 mm.
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

struct Log<'a> {
    path: &'a Path,
    lines: std::str::Lines<'a>,
    line: usize,
}

impl Log<'_> {
    fn broken(&self, expected: &'static str) -> PushError {
        PushError::Log { path: self.path.to_owned(), line: self.line, expected }
    }

    fn numbers<const N: usize>(&mut self, expected: &'static str) -> Result<[f64; N], PushError> {
        self.line += 1;
        let text = self.lines.next().ok_or_else(|| self.broken(expected))?;
        let mut numbers = [0.0; N];
        let mut cells = text.split_whitespace();
        for number in &mut numbers {
            *number = cells
                .next()
                .and_then(|cell| cell.parse::<f64>().ok())
                .filter(|v| v.is_finite())
                .ok_or_else(|| self.broken(expected))?;
        }
        match cells.next() {
            None => Ok(numbers),
            Some(_) => Err(self.broken(expected)),
        }
    }

    /// A block of rows after their number; rows at an equal or earlier time than the one before are left out
    /// (the robot's stamps repeat at the end of a push).
    fn rows<const N: usize>(
        &mut self,
        count: &'static str,
        row: &'static str,
    ) -> Result<Vec<[f64; N]>, PushError> {
        let [rows] = self.numbers(count)?;
        let mut all: Vec<[f64; N]> = Vec::new();
        for _ in 0..rows as usize {
            let next = self.numbers(row)?;
            if all.last().is_some_and(|last| next[0] < last[0]) {
                return Err(self.broken("a later time"));
            }
            if all.last().is_none_or(|last| next[0] > last[0]) {
                all.push(next);
            }
        }
        match all.len() < 2 {
            true => Err(self.broken("at least two samples")),
            false => Ok(all),
        }
    }

    /// One push.
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
        let tool = tool_yaw(&rod[0][4..]);
        // The sensor's y axis is mirrored, and turned by an eighth from the tool; its offset is that of the first
        // sample, before contact. The sign is that of the force on the rod.
        let to_world = PlanarPose { theta_rad: tool + FRAC_PI_4, ..PlanarPose::default() };
        let forces: Vec<[f64; 2]> =
            force.iter().map(|f| to_world.rotate([f[1] - force[0][1], force[0][2] - f[2]])).collect();

        let stream = |time_s: Vec<f64>, columns: Vec<Vec<f64>>, bridge| Source {
            time_s: time_s.into_iter().map(|t| t - start_s).collect(),
            angular: (0..columns.len()).map(|i| i == 2).collect(),
            columns,
            longest_bridge_s: bridge,
        };
        let sources = [
            stream(
                rod.iter().map(|r| r[0]).collect(),
                vec![
                    rod.iter().map(|r| r[1] / 1000.0).collect(),
                    rod.iter().map(|r| r[2] / 1000.0).collect(),
                ],
                LONGEST_BRIDGE_S,
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
                LONGEST_BRIDGE_S,
            ),
        ];
        let joined = union(&sources).ok_or_else(|| PushError::NoCommonTime { path: self.path.to_owned() })?;
        Trajectory::new(id, joined.time_s, [joined.columns, joined.fresh].concat())
    }
}

/// Pose of the centroid from a logged pose of the corner, `x y z` in mm and a quaternion `w x y z`.
fn centroid([x, y, _, w, i, j, k]: [f64; 7]) -> PlanarPose {
    let corner = PlanarPose { x_m: x / 1000.0, y_m: y / 1000.0, theta_rad: yaw(w, i, j, k) };
    let [x_m, y_m] = corner.point(CENTROID_M);
    PlanarPose { x_m, y_m, ..corner }
}

fn tool_yaw(q: &[f64]) -> f64 {
    yaw(q[0], q[1], q[2], q[3])
}

/// Rotation about z of a quaternion, rad.
fn yaw(w: f64, i: f64, j: f64, k: f64) -> f64 {
    (2.0 * (w * k + i * j)).atan2(1.0 - 2.0 * (j * j + k * k))
}
