//! Contents of the files of a recording: rows under headings, the columns that they become, and the kind of recording.

use super::dialect::Sheet;
use super::heading::Heading;
use super::roles::Part;

/// Kind of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Recording {
    /// Something falls and is seen in this many coordinates.
    Falls(usize),
    /// A rod pushes an object.
    Pushes,
    /// Positions that do not accelerate as a fall does, with their acceleration, m/s², where there is one.
    Moves(Option<f64>),
    /// No positions.
    Other,
}

/// One file.
pub(super) struct Recorded {
    pub sheet: Sheet,
    pub headings: Vec<Heading>,
    pub parts: Vec<Part>,
}

/// A column of the data set: where it is from, what it is called, and what its values are multiplied by.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    /// Place among the values of the drafts.
    pub value: usize,
    /// Name in the file.
    pub from: String,
    pub name: String,
    pub factor: f64,
}
