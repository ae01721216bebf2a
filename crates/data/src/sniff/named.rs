//! Converts a recording of unknown layout to CSV in long form, line by line.

use super::RecognitionOptions;
use super::dialect::{number, read_table};
use super::heading::{Heading, Quantity};
use super::roles::{Role, assign_roles};
use super::text::decode;
use crate::column::{TIME, TRAJECTORY};
use crate::whole_file::{gunzip, is_gzip};
use std::path::Path;

/// Converts a table in any dialect to CSV in long form; `None` where no time column is found.
///
/// The time column becomes `t_s`, the column of trajectory identifiers `trajectory`, and a column with a unit
/// is converted to SI and renamed (`Angle (deg)` becomes `angle_rad`). Each row keeps its line number, for
/// messages.
pub(crate) fn in_long_form(path: &Path, bytes: &[u8]) -> Option<Vec<u8>> {
    let unpacked = if is_gzip(bytes) { gunzip(path, bytes).ok()? } else { bytes.to_vec() };
    let (text, _) = decode(&unpacked)?;
    let sheet = read_table(path, &text, None, None).ok()?;
    let unit = |i: usize| sheet.units.get(i).map_or("", String::as_str);
    let names = sheet.names.as_ref()?;
    let headings: Vec<Heading> = names.iter().enumerate().map(|(i, n)| Heading::read(n, unit(i))).collect();
    let roles = assign_roles(&headings, &RecognitionOptions::default()).ok()?;
    let mut has_time = false;
    let columns: Vec<(String, f64)> = headings
        .iter()
        .zip(&roles)
        .map(|(h, role)| match role {
            Role::Time(unit) if unit.is_none_or(|u| u.quantity == Quantity::Time) => {
                has_time = true;
                (TIME.to_owned(), unit.map_or(1.0, |u| u.factor))
            }
            Role::Trajectory => (TRAJECTORY.to_owned(), 1.0),
            _ => si_name(h),
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

/// Name of a column in SI units, and the conversion factor; a column without a unit keeps its name.
fn si_name(h: &Heading) -> (String, f64) {
    let Some(unit) = h.unit else { return (h.raw.clone(), 1.0) };
    let suffix = match unit.quantity {
        Quantity::Length => "m",
        Quantity::Time => "s",
        Quantity::Angle => "rad",
        Quantity::Speed => "m_s",
        Quantity::AngularSpeed => "rad_s",
        Quantity::Pixels | Quantity::Frames => return (h.raw.clone(), 1.0),
    };
    (format!("{}_{suffix}", h.words.join("_")), unit.factor)
}
