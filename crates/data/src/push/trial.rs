//! One published trial of the MIT Push set, and its conversion to a trajectory.

use super::error::PushError;
use super::frame::PlanarPose;
use super::stream::Stream;
use super::trial_name::TrialName;
use super::union_clock::{Source, union};
use super::{hdf5, json};
use crate::error::DataError;
use crate::trajectory::Trajectory;
use crate::whole_file::read_whole;
use std::path::{Path, PathBuf};

/// Column names of a data set of pushes with measured force on the rod.
pub(crate) const TRIAL_COLUMNS: [&str; 10] = [
    "pusher_x_m",
    "pusher_y_m",
    "x_m",
    "y_m",
    "theta_rad",
    "force_x_N",
    "force_y_N",
    "pusher_new",
    "object_new",
    "force_new",
];

/// One measured push: three streams with separate clocks, in the frame of the robot's base (z up).
#[derive(Debug, Clone, PartialEq)]
pub struct PushTrial {
    /// Parsed file name, which states the settings of the push.
    pub name: TrialName,
    /// Path of the file; for a member of an archive, the path of the archive and the name of the member.
    pub path: PathBuf,
    /// Unix time of `t = 0`, s: the first time at which all three streams are available.
    pub start_s: f64,
    /// Stream of the rod: x, y of its centre in m, yaw of the tool in rad.
    pub tip: Stream,
    /// Stream of the object's tracked frame: x, y in m, yaw in rad without jumps by full turns.
    pub object: Stream,
    /// Stream of the wrench on the rod: force x, y in N, torque about z in N m.
    pub wrench: Stream,
    /// Number of object poses that were removed because the motion capture confused the markers.
    pub removed_poses: usize,
}

impl PushTrial {
    /// Reads a push trial from an HDF5 or JSON file, whose format is recognised from the content.
    ///
    /// The settings of the push are in the file name.
    ///
    /// # Errors
    /// [`DataError::Unreadable`], or a [`PushError`] of a single file.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        Ok(Self::from_bytes(path, read_whole(path)?)?)
    }

    pub(super) fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, PushError> {
        const KEYS: [&str; 3] = ["tip_pose", "object_pose", "ft_wrench"];
        let name = TrialName::parse(path)?;
        let rows = if is_hdf5(&bytes) {
            hdf5::rows(path, bytes, KEYS)?
        } else if is_json(&bytes) {
            json::rows(path, &bytes, KEYS)?
        } else {
            return Err(PushError::UnknownContent { path: path.to_owned() });
        };
        let mut streams = Vec::with_capacity(3);
        for (key, rows) in KEYS.into_iter().zip(&rows) {
            streams.push(Stream::from_rows(path, key, rows)?);
        }
        let start_s = streams.iter().map(|s| s.time_s[0]).fold(f64::NEG_INFINITY, f64::max);
        let mut streams = streams.into_iter().map(|s| s.earlier(start_s));
        let mut next = || streams.next().unwrap_or_default();
        let (tip, (object, removed_poses), wrench) = (next(), next().without_quarter_turns(), next());
        if object.len() < 2 {
            return Err(PushError::TooShort { path: path.to_owned(), key: "object_pose" });
        }
        Ok(PushTrial { name, path: path.to_owned(), start_s, tip, object, wrench, removed_poses })
    }

    /// Converts the trial to a trajectory at the union of the three streams' times, named as the file.
    ///
    /// Columns are the rod, the pose of the object's area centroid, the force on the rod, and flags that are 1 at the
    /// measured samples of each stream. Repeats of a measurement of the rod (see [`Stream::without_repeats`]) are not
    /// flagged.
    ///
    /// # Errors
    /// [`PushError::NoCommonTime`] where the streams do not overlap in time.
    pub fn trajectory(&self) -> Result<Trajectory, DataError> {
        let columns = |stream: &Stream, angular: &[bool]| Source {
            time_s: stream.time_s.clone(),
            columns: stream.values[..angular.len()].to_vec(),
            angular: angular.to_vec(),
            max_interpolated_s: f64::INFINITY,
        };
        let object = self.centroid();
        let sources = [
            columns(&self.tip.without_repeats(), &[false, false]),
            columns(&object, &[false, false, true]),
            columns(&self.wrench, &[false, false]),
        ];
        let joined = union(&sources).ok_or_else(|| PushError::NoCommonTime { path: self.path.clone() })?;
        let values = [joined.columns, joined.fresh].concat();
        Trajectory::new(self.name.to_string(), joined.time_s, values)?.with_group(self.name.group())
    }

    /// Pose of the object over time, with the position of its area centroid instead of the tracked frame's.
    pub fn centroid(&self) -> Stream {
        let mut object = self.object.clone();
        let offset = self.name.centroid_m();
        let [x, y, yaw] = &mut object.values;
        for ((x_m, y_m), &theta_rad) in x.iter_mut().zip(y).zip(&*yaw) {
            [*x_m, *y_m] = PlanarPose { x_m: *x_m, y_m: *y_m, theta_rad }.point(offset);
        }
        object
    }
}

/// Whether the name of a file is that of a published trial.
pub(crate) fn is_named_like_a_trial(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with("motion_") || name.starts_with("block=")
}

/// Whether a JSON file holds a published trial, by its name or by the names of its streams.
pub(crate) fn holds_trials(path: &Path, json: &[u8]) -> bool {
    let has = |key: &str| json.windows(key.len()).any(|w| w == key.as_bytes());
    is_named_like_a_trial(path)
        || ["\"tip_pose\"", "\"object_pose\"", "\"ft_wrench\""].iter().any(|key| has(key))
}

/// Whether the bytes begin with the magic number of HDF5.
pub(crate) fn is_hdf5(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89HDF\r\n\x1a\n")
}

fn is_json(bytes: &[u8]) -> bool {
    bytes.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'{')
}
