//! Data files as people have them: any separator, decimal mark, unit, column name and direction of up.
//!
//! [`recognise`] reads what [`read_dataset`](crate::read_dataset) refuses in the long form, and says in words what it took
//! for granted. The steps: [`text`] decodes the bytes, [`dialect`] finds separator, decimal mark, comments and header,
//! [`heading`] reads names and units, [`roles`] gives each column its part, [`rows`] makes trajectories, [`scene`] tells clock,
//! unit and direction of up, where names do not from how things [`fall`]. A wrong guess is overridden by [`Reading`].

mod assumptions;
mod dialect;
mod fall;
mod heading;
mod named;
mod recognised;
mod recording;
mod roles;
mod rows;
mod scene;
mod text;
mod unrecognised;

pub(crate) use named::in_long_form;
pub use recognised::{Recognised, recognise};
pub(crate) use recognised::{files_in, recognise_bytes, stem};
pub use recording::Recording;
pub use unrecognised::Unrecognised;

/// Statements of a user about files, where the sniffing would guess otherwise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    /// Character between cells; a blank stands for any run of blanks.
    pub separator: Option<char>,
    /// Decimal mark: a point or a comma.
    pub decimal: Option<char>,
    /// Column of the time, with its unit after a colon, such as `frame`, `clock:ms`.
    pub time: Option<String>,
    /// Column of the trajectory.
    pub trajectory: Option<String>,
    /// Columns by hand: name in the file, name that it gets (`x_m`, `z_m`, `height_m`), and its unit in the file.
    pub columns: Vec<Renamed>,
    /// Column that counts upwards, with a minus where it counts downwards.
    pub up: Option<String>,
    /// Frames a second, where times are frame numbers or absent.
    pub rate_hz: Option<f64>,
}

/// A column that a user names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Renamed {
    /// Name in the file.
    pub from: String,
    /// Name that it gets, its unit included.
    pub to: String,
    /// Its unit in the file; without it that of its name there, or else that of `to`.
    pub unit: Option<String>,
}

impl std::str::FromStr for Renamed {
    type Err = String;

    /// Reads `x=x_m:cm` or `x=x_m`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let usual = || format!("`{text}` is not of the form NAME=COLUMN:UNIT, such as x=x_m:cm");
        let (from, rest) = text.split_once('=').ok_or_else(usual)?;
        let (to, unit) = match rest.split_once(':') {
            Some((to, unit)) => (to, Some(unit.trim().to_owned())),
            None => (rest, None),
        };
        let (from, to) = (from.trim().to_owned(), to.trim().to_owned());
        if from.is_empty() || to.is_empty() {
            return Err(usual());
        }
        if let Some(unknown) = unit.as_deref().filter(|u| heading::Scale::given(u).is_none()) {
            return Err(format!("`{unknown}` is no known unit; {}", heading::KNOWN_UNITS));
        }
        crate::Column::new(&to).map_err(|e| e.to_string())?;
        Ok(Renamed { from, to, unit })
    }
}
