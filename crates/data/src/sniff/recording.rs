//! A file of unknown layout with the roles of its columns, and the kind of recording that it holds.

use super::dialect::Sheet;
use super::heading::Heading;
use super::roles::Role;
use crate::dataset::Dataset;

/// Kind of motion that a recording shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordingKind {
    /// An object falls freely; the number of its coordinates (1 to 3).
    Falls(usize),
    /// A rod pushes an object.
    Pushes,
    /// Positions that do not accelerate as in free fall, with the vertical acceleration, m/s²; `None` if unknown.
    Moves(Option<f64>),
    /// The recording has no positions.
    Other,
}

impl RecordingKind {
    /// Kind of motion of a data set in the long form, from the names of its columns.
    pub fn of(data: &Dataset) -> Self {
        match (data.has_column("pusher_x_m"), data.has_column("x_m") && data.has_column("z_m")) {
            (true, _) => RecordingKind::Pushes,
            (_, true) => RecordingKind::Falls(if data.has_column("y_m") { 3 } else { 2 }),
            _ if data.has_column("height_m") => RecordingKind::Falls(1),
            _ => RecordingKind::Other,
        }
    }

    /// Name of the kind for the user, such as `throws in a plane`.
    pub fn name(self) -> &'static str {
        match self {
            RecordingKind::Falls(1) => "drops",
            RecordingKind::Falls(2) => "throws in a plane",
            RecordingKind::Falls(_) => "throws in space",
            RecordingKind::Pushes => "pushes",
            RecordingKind::Moves(_) => "a motion without free fall",
            RecordingKind::Other => "other data",
        }
    }
}

/// One file of unknown layout: its table, and the heading and role of each column.
pub(super) struct RecordedFile {
    pub sheet: Sheet,
    pub headings: Vec<Heading>,
    pub roles: Vec<Role>,
}

/// Column of the data set that is built: its source in the file, its name, and the conversion to SI.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    /// Index of the source among the columns of values of `Draft`.
    pub value: usize,
    /// Name of the column in the file.
    pub from: String,
    pub name: String,
    pub factor: f64,
    /// Offset of the conversion, SI units: the value of 0 in the file's unit; not 0 only for degC and degF.
    pub offset: f64,
}
