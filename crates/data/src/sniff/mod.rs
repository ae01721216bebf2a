//! Reads tables of unknown layout: any separator, decimal mark, unit, column name and direction of up.
//!
//! [`recognise`] reads files that are not in the long form, and returns a note for each of its assumptions.
//! The steps:
//! 1. [`text`] decodes the bytes.
//! 2. [`dialect`] infers separator, decimal mark, comments and header.
//! 3. [`heading`] parses names and units.
//! 4. [`roles`] assigns a role to each column.
//! 5. [`rows`] groups the rows into trajectories.
//! 6. [`clock`] infers the unit of the time, with the words of [`calendar`].
//! 7. [`scene`] infers unit of length and direction of up; where names do not state them, from
//!    free [`fall`].
//!
//! A user overrides a wrong inference with [`RecognitionOptions`].

mod assumptions;
mod calendar;
mod clock;
mod dialect;
mod fall;
mod heading;
mod named;
mod recognised;
mod recording;
mod roles;
mod rows;
mod scene;
mod side_by_side;
mod text;
mod time_words;
mod unrecognised;

pub(crate) use named::{LongForm, NamedUnit, in_long_form, units_of_header};
pub use recognised::{RecognisedData, recognise};
pub(crate) use recognised::{files_in, recognise_bytes, stem};
pub use recording::RecordingKind;
pub(crate) use roles::names_trajectories;
pub use unrecognised::Unrecognised;

/// Layout of a file as the user states it for [`recognise`]; each `None` is inferred.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecognitionOptions {
    /// Character between cells; a space stands for any sequence of white space.
    pub separator: Option<char>,
    /// Decimal mark: a point or a comma.
    pub decimal: Option<char>,
    /// Name of the time column, optionally with its unit after a colon, such as `frame` or `clock:ms`.
    pub time: Option<String>,
    /// Name of the column of trajectory identifiers.
    pub trajectory: Option<String>,
    /// Columns of values that the user renames: name in the file, new name (such as `x_m`), unit in the file.
    pub columns: Vec<ColumnMapping>,
    /// Name of the vertical column, with a minus before it where the values grow downwards.
    pub up: Option<String>,
    /// Frame rate, Hz, for files whose times are frame numbers or absent.
    pub rate_hz: Option<f64>,
}

/// Column of values that the user renames, with its unit in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnMapping {
    /// Name of the column in the file.
    pub from: String,
    /// New name of the column, including its SI unit.
    pub to: String,
    /// Unit of the values in the file; `None` takes the unit in the name `from`, or else that of `to`.
    pub unit: Option<String>,
}

/// Writes the mapping as it is on the command line, such as `x=x_m:cm`.
impl std::fmt::Display for ColumnMapping {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let unit = self.unit.as_ref().map_or(String::new(), |unit| format!(":{unit}"));
        write!(f, "{}={}{unit}", self.from, self.to)
    }
}

impl std::str::FromStr for ColumnMapping {
    type Err = String;

    /// Parses a mapping such as `x=x_m:cm` (name in the file, new name, unit) or `x=x_m`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong_form = || format!("`{text}` is not of the form NAME=COLUMN:UNIT, such as x=x_m:cm");
        let (from, target) = text.split_once('=').ok_or_else(wrong_form)?;
        let (to, unit) = match target.split_once(':') {
            Some((to, unit)) => (to, Some(unit.trim().to_owned())),
            None => (target, None),
        };
        let (from, to) = (from.trim().to_owned(), to.trim().to_owned());
        if from.is_empty() || to.is_empty() {
            return Err(wrong_form());
        }
        if let Some(unknown) = unit.as_deref().filter(|u| heading::ColumnUnit::parse_option(u).is_none()) {
            return Err(format!("`{unknown}` is not a known unit; {}", heading::KNOWN_UNITS));
        }
        crate::Column::new(&to).map_err(|e| e.to_string())?;
        Ok(ColumnMapping { from, to, unit })
    }
}
