//! Converts a table of unknown layout to CSV with a time in seconds, line by line.

use super::RecognitionOptions;
use super::calendar::calendar_unit;
use super::clock::{Clock, TimeCells, read_times};
use super::dialect::{Sheet, number, read_table};
use super::heading::{ColumnUnit, Heading, Quantity};
use super::roles::{Role, assign_roles, si_column};
use super::side_by_side::stacked;
use super::text::decode;
use super::unrecognised::Unrecognised;
use crate::column::{Column, TIME, TRAJECTORY};
use crate::error::DataError;
use crate::escape_control_characters::escaped_short;
use crate::statistics::digits;
use crate::unit::{FileUnit, Unit};
use std::collections::BTreeMap;
use std::path::Path;

/// Name and unit conversion of a column whose header states a unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedUnit {
    /// Column name in lower case, without the unit.
    pub base: String,
    /// Column name with the SI unit, such as `angle_rad`.
    pub si_name: String,
    /// Conversion of the column's values to SI units.
    pub conversion: FileUnit,
}

/// Table of unknown layout after its conversion to CSV, with the units of its columns.
#[derive(Debug)]
pub(crate) struct LongForm {
    /// CSV text of the table; the time is in the column `t_s`, the identifier of trajectories in `trajectory`.
    pub csv: Vec<u8>,
    /// Unit of each column; `None` where the file states none.
    pub units: Vec<Option<NamedUnit>>,
    /// Assumptions about the time column, one sentence each.
    pub notes: Vec<String>,
}

/// Units that the header of a file in the long form states, one per column.
pub(crate) fn units_of_header(header: &[String]) -> Vec<Option<NamedUnit>> {
    header.iter().map(|name| named_unit(&Heading::read(name, ""))).collect()
}

fn named_unit(h: &Heading) -> Option<NamedUnit> {
    let (si_name, conversion) = si_column(h)?;
    Some(NamedUnit { base: h.base().to_lowercase(), si_name, conversion })
}

/// Converts a table in any dialect to CSV in long form; `None` where no time column is found.
///
/// The time column becomes `t_s`, in seconds, the column of trajectory identifiers `trajectory`; the other
/// columns keep their names and values. Each row keeps its line number, for messages. `time` is the column that
/// the user names, with its unit after a colon.
///
/// # Errors
/// The time column that the user names does not exist, or its unit or a cell cannot be read.
pub(crate) fn in_long_form(
    path: &Path,
    bytes: &[u8],
    time: Option<&str>,
) -> Result<Option<LongForm>, DataError> {
    let Some((text, _)) = decode(bytes) else { return Ok(None) };
    let sheet = match read_table(path, &text, None, None) {
        Ok(sheet) => stacked(sheet),
        Err(cause) => return if time.is_some() { Err(cause) } else { Ok(None) },
    };
    let Some(names) = &sheet.names else { return Ok(None) };
    let unit = |i: usize| sheet.units.get(i).map_or("", String::as_str);
    let headings: Vec<Heading> = names.iter().enumerate().map(|(i, n)| Heading::read(n, unit(i))).collect();
    let options = RecognitionOptions { time: time.map(str::to_owned), ..RecognitionOptions::default() };
    let refuse = |reason| DataError::NotRecognised { path: path.to_owned(), reason };
    let roles = assign_roles(&headings, &options).map_err(refuse)?;
    let time_role =
        |role: &Role| matches!(role, Role::Time(unit) if unit.is_none_or(|u| u.quantity == Quantity::Time));
    let Some(time_column) = roles.iter().position(time_role) else {
        return if time.is_some() { Err(refuse(Unrecognised::NoFrameRate)) } else { Ok(None) };
    };
    let id_column = roles.iter().position(|role| *role == Role::Trajectory);
    let (seconds, notes) = seconds(&sheet, &headings, &roles, (time_column, id_column))?;
    let header: Vec<String> = headings
        .iter()
        .enumerate()
        .map(|(i, h)| match i {
            i if i == time_column => TIME.to_owned(),
            i if Some(i) == id_column => TRAJECTORY.to_owned(),
            // A name that is no name of a quantity gets the one that `start` gives it.
            i if h.unit.is_none() && !h.raw.is_empty() => column_name(h, i, "").0,
            _ => h.raw.clone(),
        })
        .collect();
    let header = header.iter().map(String::as_str);
    let units = headings
        .iter()
        .enumerate()
        .map(|(i, h)| named_unit(h).filter(|_| i != time_column && Some(i) != id_column));
    let units = units.collect();
    let csv = csv_text(&sheet, header, |row, column| {
        if column == time_column {
            return seconds[row].map_or_else(String::new, |t| t.to_string());
        }
        let cell = &sheet.row(row)[column];
        match number(cell, sheet.dialect.decimal) {
            Ok(None) => String::new(),
            Ok(Some(value)) if Some(column) != id_column => value.to_string(),
            _ => cell.clone(),
        }
    });
    Ok(csv.map(|csv| LongForm { csv, units, notes }))
}

/// Times of the rows, s (`None` for a gap), and notes for the user on the assumed unit.
///
/// The last argument holds the indices of the time column and of the identifier column.
fn seconds(
    sheet: &Sheet,
    headings: &[Heading],
    roles: &[Role],
    (time, id): (usize, Option<usize>),
) -> Result<(Vec<Option<f64>>, Vec<String>), DataError> {
    let heading = &headings[time];
    let TimeCells { values, written } = read_times(sheet, time, &heading.raw)?;
    let mut runs: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let run_of = |row: usize| id.map_or("", |id| sheet.row(row)[id].as_str());
    for (row, value) in values.iter().enumerate() {
        runs.entry(run_of(row)).or_default().extend(value);
    }
    let unit = match &roles[time] {
        Role::Time(unit) => *unit,
        _ => None,
    };
    let lists: Vec<&[f64]> = runs.values().map(Vec::as_slice).collect();
    let refuse = |reason| DataError::NotRecognised { path: sheet.path.clone(), reason };
    let name = (heading.raw.as_str(), heading.unit_text.as_str());
    let mut clock = Clock::of_column(name, unit, written, &lists).map_err(refuse)?;
    clock.is_absolute |= calendar_unit(heading).is_some();
    let mut notes: Vec<String> = clock.note.clone().into_iter().collect();
    if clock.note.is_none() && clock.unit_s != 1.0 {
        notes.push(format!(
            "{} times {} is the time in seconds",
            escaped_short(&heading.raw),
            digits(clock.unit_s)
        ));
    }
    if clock.note.is_none() && clock.is_absolute {
        notes.push("times count from the first sample of each trajectory".to_owned());
    }
    let zero = |row: usize| match clock.is_absolute {
        true => runs[run_of(row)].first().copied().unwrap_or(0.0),
        false => 0.0,
    };
    let seconds = values.iter().enumerate().map(|(row, t)| t.map(|t| clock.seconds(t, zero(row))));
    Ok((seconds.collect(), notes))
}

/// Writes a table as CSV, with each row on the same line as in the file.
fn csv_text<'a>(
    sheet: &Sheet,
    header: impl Iterator<Item = &'a str>,
    cell: impl Fn(usize, usize) -> String,
) -> Option<Vec<u8>> {
    let mut rows = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    rows.write_record(header).ok()?;
    let mut out = rows.into_inner().ok()?;
    let mut line = 1;
    for row in 0..sheet.rows() {
        while line + 1 < sheet.lines[row] {
            out.push(b'\n');
            line += 1;
        }
        let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
        writer.write_record((0..sheet.columns).map(|column| cell(row, column))).ok()?;
        out.extend(writer.into_inner().ok()?);
        line += 1;
    }
    Some(out)
}

/// Name of a column in the data set that is built, and the conversion of its values to SI.
///
/// A name that is well formed and states no unit that is converted stays as it is. In others, words and unit
/// are joined by underscores (`Ball speed (m/s)` becomes `Ball_speed_m_s`); `index` is the number of the
/// column, for names without letters; `copy` follows the words, where the name is taken.
pub(super) fn column_name(h: &Heading, index: usize, copy: &str) -> (String, FileUnit) {
    let pure = FileUnit::scaled(Unit::DIMENSIONLESS, 1.0);
    let is_well_formed = copy.is_empty() && Column::with_unit(&h.raw, Unit::DIMENSIONLESS).is_ok();
    if is_well_formed && Column::new(&h.raw).is_ok() && h.unit.is_none_or(|u| u.conversion.offset() == 0.0) {
        return (h.raw.clone(), pure);
    }
    if let Some((name, conversion)) = si_column(h).filter(|_| copy.is_empty()) {
        return (name, conversion);
    }
    let words = ascii_words(&h.base(), index) + copy;
    let is_converted = |u: &ColumnUnit| !matches!(u.quantity, Quantity::Pixels | Quantity::Frames);
    if let Some(unit) = h.unit.filter(is_converted) {
        return (unit.conversion.si_name(&words), unit.conversion);
    }
    if is_well_formed {
        return (h.raw.clone(), pure);
    }
    let unit: String = h.unit_text.chars().filter(char::is_ascii_alphanumeric).collect();
    let name = if unit.is_empty() { words } else { format!("{words}_{unit}") };
    (name, pure)
}

/// Name made of ASCII words joined by underscores; `column_3` (with `index` + 1) where nothing remains.
fn ascii_words(base: &str, index: usize) -> String {
    let mut text = base.to_owned();
    for (from, to) in
        [("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("Ä", "Ae"), ("Ö", "Oe"), ("Ü", "Ue"), ("ß", "ss")]
    {
        text = text.replace(from, to);
    }
    let ascii = text.split('_').map(|w| w.chars().filter(char::is_ascii_alphanumeric).collect::<String>());
    let joined = ascii.filter(|w| !w.is_empty()).collect::<Vec<_>>().join("_");
    match joined.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => joined,
        false if joined.chars().all(|c| c.is_ascii_digit()) => format!("column_{}", index + 1),
        false => format!("column_{joined}"),
    }
}
