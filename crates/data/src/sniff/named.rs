//! Converts a recording of unknown layout to CSV in long form, line by line.

use super::RecognitionOptions;
use super::dialect::{number, read_table};
use super::heading::{FileUnit, Heading, Quantity};
use super::roles::{Role, assign_roles};
use super::side_by_side::stacked;
use super::text::decode;
use crate::column::{Column, TIME, TRAJECTORY};
use crate::unit::Unit;
use std::path::Path;

/// Converts a table in any dialect to CSV in long form; `None` where no time column is found.
///
/// The time column becomes `t_s`, the column of trajectory identifiers `trajectory`, and a column with a unit
/// is converted to SI and renamed (`Angle (deg)` becomes `angle_rad`). Each row keeps its line number, for
/// messages.
pub(crate) fn in_long_form(path: &Path, bytes: &[u8]) -> Option<Vec<u8>> {
    let (text, _) = decode(bytes)?;
    let sheet = stacked(read_table(path, &text, None, None).ok()?);
    let unit = |i: usize| sheet.units.get(i).map_or("", String::as_str);
    let names = sheet.names.as_ref()?;
    let headings: Vec<Heading> = names.iter().enumerate().map(|(i, n)| Heading::read(n, unit(i))).collect();
    let roles = assign_roles(&headings, &RecognitionOptions::default()).ok()?;
    let mut has_time = false;
    let columns: Vec<(String, f64)> = headings
        .iter()
        .zip(&roles)
        .enumerate()
        .map(|(i, (h, role))| match role {
            Role::Time(unit) if unit.is_none_or(|u| u.quantity == Quantity::Time) => {
                has_time = true;
                (TIME.to_owned(), unit.map_or(1.0, |u| u.factor))
            }
            Role::Trajectory => (TRAJECTORY.to_owned(), 1.0),
            _ => column_name(h, i, ""),
        })
        .collect();
    if !has_time {
        return None;
    }
    let mut rows = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    rows.write_record(columns.iter().map(|(name, _)| name)).ok()?;
    let mut out = rows.into_inner().ok()?;
    let mut line = 1;
    for row in 0..sheet.rows() {
        while line + 1 < sheet.lines[row] {
            out.push(b'\n');
            line += 1;
        }
        let cells = sheet.row(row).iter().zip(&columns).map(|(cell, (name, factor))| {
            match number(cell, sheet.dialect.decimal) {
                Ok(None) => String::new(),
                Ok(Some(value)) if name != TRAJECTORY => (value * factor).to_string(),
                _ => cell.clone(),
            }
        });
        let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
        writer.write_record(cells).ok()?;
        out.extend(writer.into_inner().ok()?);
        line += 1;
    }
    Some(out)
}

/// Name of a column in SI units, and the factor that converts its values.
///
/// A name that is well formed and states no unit that is converted stays as it is. In others, words and unit
/// are joined by underscores (`Ball speed (m/s)` becomes `ball_speed_m_s`); `index` is the number of the
/// column, for names without letters; `copy` follows the words, where the name is taken.
pub(super) fn column_name(h: &Heading, index: usize, copy: &str) -> (String, f64) {
    if copy.is_empty() && Column::new(&h.raw).is_ok() {
        return (h.raw.clone(), 1.0);
    }
    let words = ascii_words(&h.words, index);
    if let Some((suffix, factor)) = h.unit.and_then(si_suffix) {
        return (format!("{words}{copy}_{suffix}"), factor);
    }
    if copy.is_empty() && Column::with_unit(&h.raw, Unit::DIMENSIONLESS).is_ok() {
        return (h.raw.clone(), 1.0);
    }
    let unit =
        h.unit_text.replace(['·', '⋅', '*', ' '], "_").replace('/', "_per_").replace(['^', '(', ')'], "");
    let unit = unit.replace('²', "2").replace('³', "3").replace('Ω', "Ohm");
    let known =
        |suffix: &str| Some(format!("{words}{copy}_{suffix}")).filter(|name| Column::new(name).is_ok());
    let compound = unit.replace("_per_", "_");
    if let Some(name) = known(&compound).filter(|_| !unit.starts_with("_per_")).or_else(|| known(&unit)) {
        return (name, 1.0);
    }
    let unit: String = unit.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    let name = if unit.is_empty() { format!("{words}{copy}") } else { format!("{words}{copy}_{unit}") };
    (name, 1.0)
}

/// Words joined by underscores, in ASCII letters; `column_3` where nothing remains.
fn ascii_words(words: &[String], index: usize) -> String {
    let ascii = |word: &String| -> String {
        let word = word.replace('ä', "ae").replace('ö', "oe").replace('ü', "ue").replace('ß', "ss");
        word.chars().filter(char::is_ascii_alphanumeric).collect()
    };
    let joined = words.iter().map(ascii).filter(|w| !w.is_empty()).collect::<Vec<_>>().join("_");
    match joined.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => joined,
        false if joined.is_empty() || joined.chars().all(|c| c.is_ascii_digit()) => {
            format!("column_{}", index + 1)
        }
        false => format!("column_{joined}"),
    }
}

/// Suffix of the SI unit to which a unit is converted, and the factor; `None` for pixels and frames.
fn si_suffix(unit: FileUnit) -> Option<(&'static str, f64)> {
    let suffix = match unit.quantity {
        Quantity::Length => "m",
        Quantity::Time => "s",
        Quantity::Angle => "rad",
        Quantity::Speed => "m_s",
        Quantity::AngularSpeed => "rad_s",
        Quantity::Pixels | Quantity::Frames => return None,
    };
    Some((suffix, unit.factor))
}
