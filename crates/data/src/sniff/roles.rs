//! Infers the role of each column from its name.

use super::calendar::{calendar_unit, is_date};
use super::heading::{ColumnUnit, Heading, Quantity};
use super::time_words::TIME_WORDS;
use super::unrecognised::Unrecognised;
use super::{ColumnMapping, RecognitionOptions};
use crate::column::{Column, GROUP};
use crate::unit::{FileUnit, Unit};

/// Coordinate that a column name denotes, before the vertical direction is inferred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Axis {
    X,
    Y,
    Z,
    /// A coordinate whose name says that it is vertical.
    Height,
    PusherX,
    PusherY,
    Theta,
}

impl Axis {
    /// Whether the coordinate is a position of the object (neither of the rod nor an angle).
    pub fn is_position(self) -> bool {
        matches!(self, Axis::X | Axis::Y | Axis::Z | Axis::Height)
    }
}

/// Role of a column of a table of unknown layout.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Role {
    /// The column is the time; `None` where its unit is not stated.
    Time(Option<ColumnUnit>),
    Trajectory,
    Group,
    /// The column is a coordinate; `None` where its unit is not stated.
    Axis(Axis, Option<ColumnUnit>),
    /// The column is any other quantity, with its name in the data set and its conversion to SI.
    Named(String, FileUnit),
    /// The column is not used.
    Unused,
}

/// Words that name a column of frame numbers.
const FRAME: [&str; 7] = ["frame", "frames", "index", "idx", "sample", "image", "bild"];
/// Words that name a column of trajectory identifiers.
const TRAJECTORY: [&str; 29] = [
    "trajectory",
    "traj",
    "run",
    "trial",
    "throw",
    "drop",
    "toss",
    "experiment",
    "exp",
    "track",
    "test",
    "take",
    "clip",
    "rep",
    "repetition",
    "shot",
    "series",
    "sequence",
    "seq",
    "episode",
    "recording",
    "particle",
    "versuch",
    "wurf",
    "lauf",
    "messung",
    "durchgang",
    "essai",
    "push",
];
/// Words in column names that mean a number or an identifier.
const COUNTING: [&str; 9] = ["id", "no", "nr", "number", "num", "n", "name", "idx", "index"];
/// Words that are ignored beside the name of a coordinate, such as the object or "position".
const IGNORED: [&str; 22] = [
    "pos",
    "position",
    "coord",
    "coordinate",
    "coordinates",
    "ball",
    "object",
    "obj",
    "marker",
    "center",
    "centre",
    "com",
    "mass",
    "a",
    "point",
    "raw",
    "tracked",
    "slider",
    "block",
    "world",
    "location",
    "tracker",
];
/// Words that name a vertical coordinate.
const HEIGHT: [&str; 10] =
    ["height", "h", "altitude", "elevation", "hoehe", "höhe", "hauteur", "altura", "altezza", "vertical"];
/// Words in column names that denote the rod that pushes an object.
const ROD: [&str; 8] = ["pusher", "rod", "tip", "probe", "finger", "robot", "ee", "effector"];
/// Words that name the angle of a pushed object.
const ANGLE: [&str; 8] = ["theta", "angle", "yaw", "orientation", "rotation", "winkel", "heading", "th"];

/// Whether `words` is not empty and all its words are in `list`.
fn are_all_in(words: &[&str], list: &[&str]) -> bool {
    !words.is_empty() && words.iter().all(|w| list.contains(w))
}

/// Whether a column of this name holds the identifiers of trajectories.
pub(crate) fn names_trajectories(name: &str) -> bool {
    TRAJECTORY.contains(&name.trim().to_lowercase().as_str())
}

/// Assigns a role to each column from the options and from its heading; each role is assigned once.
///
/// # Errors
/// A column that an option names does not exist.
pub(super) fn assign_roles(
    headings: &[Heading],
    reading: &RecognitionOptions,
) -> Result<Vec<Role>, Unrecognised> {
    let mut roles: Vec<Role> = headings.iter().map(|_| Role::Unused).collect();
    let mut is_assigned = vec![false; headings.len()];
    let position = |name: &str, option: &'static str| {
        let same = |h: &&Heading| h.raw == name || h.raw.eq_ignore_ascii_case(name);
        headings
            .iter()
            .position(|h| same(&h))
            .or_else(|| headings.iter().position(|h| h.words.join("_") == name.to_lowercase()))
            .ok_or_else(|| {
                let columns = headings.iter().map(|h| h.raw.clone()).collect();
                Unrecognised::NoSuchColumn { option, name: name.to_owned(), columns }
            })
    };
    if let Some(time) = &reading.time {
        let (name, unit) = name_and_unit(headings, time)?;
        let column = position(name, "--time")?;
        let written =
            headings[column].unit.filter(|u| matches!(u.quantity, Quantity::Time | Quantity::Frames));
        (roles[column], is_assigned[column]) = (
            Role::Time(
                unit.or(written).or(calendar_unit(&headings[column])).or(frames_unit(&headings[column])),
            ),
            true,
        );
    }
    if let Some(name) = &reading.trajectory {
        let column = position(name, "--trajectory")?;
        (roles[column], is_assigned[column]) = (Role::Trajectory, true);
    }
    for renamed in &reading.columns {
        let column = position(&renamed.from, "--columns")?;
        let conversion = conversion_of(renamed, headings[column].unit)?;
        (roles[column], is_assigned[column]) = (Role::Named(renamed.to.clone(), conversion), true);
    }
    let has = |roles: &[Role], role: &dyn Fn(&Role) -> bool| roles.iter().any(role);
    // Time columns come first, because frame numbers are the time only where there is no time column.
    for (i, h) in headings.iter().enumerate() {
        let has_time = has(&roles, &|p| matches!(p, Role::Time(_)));
        if let Some(role) = time_role(h).filter(|_| !is_assigned[i] && !has_time) {
            (roles[i], is_assigned[i]) = (role, true);
        }
    }
    if !has(&roles, &|p| matches!(p, Role::Time(_))) {
        // Dates and counts of days or years come last, because they may be labels beside a time.
        let unit = |h: &Heading| if is_date(h) { Some(None) } else { calendar_unit(h).map(Some) };
        let free = |(i, h): (usize, &Heading)| Some((i, unit(h).filter(|_| !is_assigned[i])?));
        if let Some((i, unit)) = headings.iter().enumerate().find_map(free) {
            (roles[i], is_assigned[i]) = (Role::Time(unit), true);
        }
    }
    if !has(&roles, &|p| matches!(p, Role::Time(_))) {
        let frames = headings.iter().position(|h| frames_unit(h).is_some());
        if let Some(i) = frames.filter(|i| !is_assigned[*i]) {
            (roles[i], is_assigned[i]) = (Role::Time(frames_unit(&headings[i])), true);
        }
    }
    let has_rod = headings.iter().any(|h| h.words.iter().any(|w| ROD.contains(&w.as_str())));
    for (i, h) in headings.iter().enumerate().filter(|(i, _)| !is_assigned[*i]) {
        let role = value_role(h, has_rod, reading.columns.is_empty());
        let is_duplicate = match &role {
            Role::Trajectory | Role::Group => roles.contains(&role),
            Role::Axis(axis, _) => has(&roles, &|p| matches!(p, Role::Axis(other, _) if other == axis)),
            Role::Named(name, _) => has(&roles, &|p| matches!(p, Role::Named(other, _) if other == name)),
            _ => false,
        };
        if !is_duplicate {
            roles[i] = role;
        }
    }
    Ok(roles)
}

/// Conversion of a column that the user renames, from the unit of the option, or else of its heading.
fn conversion_of(renamed: &ColumnMapping, heading: Option<ColumnUnit>) -> Result<FileUnit, Unrecognised> {
    let unit = renamed.unit.as_deref().map_or(heading, ColumnUnit::parse_option);
    // A number is the size of the unit of the file in the unit of the new name.
    let is_number = renamed.unit.as_deref().is_some_and(|text| text.trim().parse::<f64>().is_ok());
    let has_quantity =
        |u: &ColumnUnit| !is_number && !matches!(u.quantity, Quantity::Pixels | Quantity::Frames);
    if let Some(unit) = unit.filter(has_quantity) {
        check_same_quantity(&renamed.to, unit.conversion)?;
    }
    Ok(unit.map_or_else(|| FileUnit::scaled(Unit::DIMENSIONLESS, 1.0), |u| u.conversion))
}

/// Splits the option `--time NAME:UNIT` into name and unit; a colon may also be part of the name.
fn name_and_unit<'t>(
    headings: &[Heading],
    time: &'t str,
) -> Result<(&'t str, Option<ColumnUnit>), Unrecognised> {
    match time.rsplit_once(':') {
        Some((name, unit)) if headings.iter().all(|h| h.raw != time) => {
            let is_time = |u: &ColumnUnit| matches!(u.quantity, Quantity::Time | Quantity::Frames);
            let known = ColumnUnit::parse(unit).filter(is_time);
            Ok((name, Some(known.ok_or_else(|| Unrecognised::UnknownTimeUnit { text: unit.to_owned() })?)))
        }
        _ => Ok((time, None)),
    }
}

/// Unit of a column of frame numbers; `None` where the heading does not name frame numbers.
fn frames_unit(h: &Heading) -> Option<ColumnUnit> {
    let words: Vec<&str> = h.words.iter().map(String::as_str).collect();
    let is_number = words.iter().all(|w| FRAME.contains(w) || COUNTING.contains(w));
    (is_number && words.iter().any(|w| FRAME.contains(w))).then(ColumnUnit::frames)
}

/// Whether a column name denotes the time.
pub(super) fn is_time(h: &Heading) -> bool {
    time_role(h).is_some()
}

/// Role of a column whose heading names the time; `None` for other headings.
fn time_role(h: &Heading) -> Option<Role> {
    let words: Vec<&str> = h.words.iter().map(String::as_str).collect();
    if !are_all_in(&words, &TIME_WORDS) || is_date(h) {
        return None;
    }
    let unit = match words[..] {
        ["sec" | "secs" | "seconds"] => ColumnUnit::parse("s"),
        ["ms"] => ColumnUnit::parse("ms"),
        _ => h.unit,
    };
    match unit {
        Some(unit) if !matches!(unit.quantity, Quantity::Time | Quantity::Frames) => None,
        unit => Some(Role::Time(unit)),
    }
}

/// Infers the role of a column that is not the time from its heading.
///
/// An angle counts only where the file has a rod (`has_rod`), coordinates only where no option names the
/// columns of values (`infer_axes`).
fn value_role(h: &Heading, has_rod: bool, infer_axes: bool) -> Role {
    let words: Vec<&str> = h.words.iter().map(String::as_str).collect();
    if h.raw == GROUP {
        return Role::Group;
    }
    let name: Vec<&str> = words.iter().copied().filter(|w| !COUNTING.contains(w)).collect();
    if h.unit.is_none() && (are_all_in(&name, &TRAJECTORY) && name.len() == 1 || words == ["id"]) {
        return Role::Trajectory;
    }
    let bare: Vec<&str> = words.iter().copied().filter(|w| !IGNORED.contains(w)).collect();
    let may_be_length = h.unit.is_none_or(|u| matches!(u.quantity, Quantity::Length | Quantity::Pixels));
    let without_rod: Vec<&str> = bare.iter().copied().filter(|w| !ROD.contains(w)).collect();
    let axis = match (&bare[..], &without_rod[..]) {
        (["x"] | ["horizontal"], _) => Some(Axis::X),
        (["y"], _) => Some(Axis::Y),
        (["z"], _) => Some(Axis::Z),
        (words, _) if are_all_in(words, &HEIGHT) => Some(Axis::Height),
        (words, ["x"]) if words.len() > 1 => Some(Axis::PusherX),
        (words, ["y"]) if words.len() > 1 => Some(Axis::PusherY),
        _ => None,
    };
    if let Some(axis) = axis.filter(|_| infer_axes && may_be_length) {
        return Role::Axis(axis, h.unit);
    }
    let may_be_angle = h.unit.is_none_or(|u| u.quantity == Quantity::Angle);
    if infer_axes && has_rod && may_be_angle && are_all_in(&bare, &ANGLE) {
        return Role::Axis(Axis::Theta, h.unit);
    }
    // Names of the long form keep their meaning, such as masses, radii, spins and flags.
    if let Ok(column) = Column::new(&h.raw) {
        let is_celsius = h.unit.is_some_and(|u| u.conversion.offset() != 0.0);
        if !is_celsius {
            return Role::Named(column.name().to_owned(), FileUnit::scaled(column.unit(), 1.0));
        }
    }
    match si_column(h) {
        Some((name, conversion)) => Role::Named(name, conversion),
        None => Role::Unused,
    }
}

/// Name of a column with its SI unit, and its conversion; `None` for a column without a unit.
pub(super) fn si_column(h: &Heading) -> Option<(String, FileUnit)> {
    let unit = h.unit.filter(|u| !matches!(u.quantity, Quantity::Pixels | Quantity::Frames))?;
    let base = h.base();
    let name = unit.conversion.si_name(&base);
    Column::new(&name).is_ok().then_some((name, unit.conversion))
}

/// Checks that a unit in the file and the unit in the new column name measure the same quantity.
fn check_same_quantity(to: &str, unit: FileUnit) -> Result<(), Unrecognised> {
    match Column::new(to) {
        Ok(column) if column.unit().dimensions() != unit.unit().dimensions() => {
            Err(Unrecognised::OtherQuantity { column: to.to_owned(), unit: unit.unit().symbol() })
        }
        _ => Ok(()),
    }
}
