//! A recording as the long form that readers of named columns take, line by line.

use super::Reading;
use super::dialect::{number, sheet};
use super::heading::{Heading, Measures};
use super::roles::{Part, roles};
use super::text::decoded;
use crate::column::{TIME, TRAJECTORY};
use crate::whole_file::{gunzip, is_gzip};
use std::path::Path;

/// The bytes of a file in any dialect as a CSV file in long form, each row on its line: the clock is `t_s`, what names the
/// trajectory `trajectory`, and a quantity with a unit has it in SI at the end of its name (`Angle (deg)` becomes
/// `angle_rad`). `None` where the clock cannot be told.
pub(crate) fn in_long_form(path: &Path, bytes: &[u8]) -> Option<Vec<u8>> {
    let unpacked = if is_gzip(bytes) { gunzip(path, bytes).ok()? } else { bytes.to_vec() };
    let (text, _) = decoded(&unpacked)?;
    let sheet = sheet(path, &text, None, None).ok()?;
    let unit = |i: usize| sheet.units.get(i).map_or("", String::as_str);
    let names = sheet.names.as_ref()?;
    let headings: Vec<Heading> = names.iter().enumerate().map(|(i, n)| Heading::read(n, unit(i))).collect();
    let parts = roles(&headings, &Reading::default()).ok()?;
    let mut clock = false;
    let columns: Vec<(String, f64)> = headings
        .iter()
        .zip(&parts)
        .map(|(h, part)| match part {
            Part::Time(scale) if scale.is_none_or(|s| s.measures == Measures::Time) => {
                clock = true;
                (TIME.to_owned(), scale.map_or(1.0, |s| s.factor))
            }
            Part::Trajectory => (TRAJECTORY.to_owned(), 1.0),
            _ => named(h),
        })
        .collect();
    if !clock {
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
        let mut one = csv::WriterBuilder::new().from_writer(Vec::new());
        one.write_record(cells).ok()?;
        out.extend(one.into_inner().ok()?);
        line += 1;
    }
    Some(out)
}

/// Name of a quantity with its unit in SI, and the factor that brings it there; without a unit it keeps its name.
fn named(h: &Heading) -> (String, f64) {
    let Some(scale) = h.unit else { return (h.raw.clone(), 1.0) };
    let suffix = match scale.measures {
        Measures::Length => "m",
        Measures::Time => "s",
        Measures::Angle => "rad",
        Measures::Speed => "m_s",
        Measures::Turning => "rad_s",
        Measures::Pixels | Measures::Frames => return (h.raw.clone(), 1.0),
    };
    (format!("{}_{suffix}", h.words.join("_")), scale.factor)
}
