//! A file of unknown layout with the roles of its columns, and the kind of recording that it holds.

use super::dialect::Sheet;
use super::heading::Heading;
use super::roles::Role;
use crate::dataset::Dataset;

/// Kind of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordingKind {
    /// A falling object with this many coordinates.
    Falls(usize),
    /// A rod pushes an object.
    Pushes,
    /// Positions that do not accelerate as in free fall, with their acceleration, m/s², where there is one.
    Moves(Option<f64>),
    /// A recording without positions.
    Other,
}

impl RecordingKind {
    /// Kind of a data set in the long form, from the names of its columns.
    pub(crate) fn of(data: &Dataset) -> Self {
        match (data.has_column("pusher_x_m"), data.has_column("x_m") && data.has_column("z_m")) {
            (true, _) => RecordingKind::Pushes,
            (_, true) => RecordingKind::Falls(if data.has_column("y_m") { 3 } else { 2 }),
            _ if data.has_column("height_m") => RecordingKind::Falls(1),
            _ => RecordingKind::Other,
        }
    }
}

/// One file: its table and the heading and role of each column.
pub(super) struct RecordedFile {
    pub sheet: Sheet,
    pub headings: Vec<Heading>,
    pub roles: Vec<Role>,
}

/// A column of the data set: its column in the file, its name, and the conversion to SI.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    /// Index among the columns of values of the drafts.
    pub value: usize,
    /// Name in the file.
    pub from: String,
    pub name: String,
    pub factor: f64,
    /// Value of 0 in SI units; not 0 only for degC and degF.
    pub offset: f64,
}
