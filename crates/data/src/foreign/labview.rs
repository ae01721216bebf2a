//! Reads LabVIEW measurement files (`.lvm`): segments with a header, one time column, and a column of comments.

use super::{damaged, quoted};
use crate::error::DataError;
use std::path::Path;

const FORMAT: &str = "a LabVIEW measurement file";
const END_OF_HEADER: &str = "***End_of_Header***";

/// Whether the file begins like a LabVIEW measurement.
pub(super) fn is_lvm(bytes: &[u8]) -> bool {
    bytes.starts_with(b"LabVIEW Measurement")
}

/// Values per channel from the header of a LabVIEW segment: units, start times and time steps.
#[derive(Debug, Clone, Default)]
struct Header {
    units: Vec<String>,
    start: Vec<String>,
    step: Vec<String>,
}

/// Converts a LabVIEW measurement to CSV text: time in s, one column per channel, one trajectory per segment.
///
/// # Errors
/// The file has no data after its header.
pub(super) fn text(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, DataError> {
    let text = String::from_utf8_lossy(bytes);
    let value = |key: &str| text.lines().find_map(|line| Some(line.strip_prefix(key)?.trim().to_owned()));
    let separator = if value("Separator\t").is_none() && value("Separator,").is_some() { ',' } else { '\t' };
    let has_comma = value("Decimal_Separator").is_some_and(|v| v.trim_start_matches(separator).trim() == ",");
    let has_clock = value("X_Columns").is_none_or(|v| v.trim() != "No");
    let number = |cell: &str| -> Option<f64> {
        let cell = cell.trim();
        if has_comma { cell.replace(',', ".").parse().ok() } else { cell.parse().ok() }
    };
    let segments = text.matches(END_OF_HEADER).count().saturating_sub(1);
    let mut header = Header::default();
    let mut names: Option<Vec<String>> = None;
    let (mut out, mut has_names, mut segment, mut row) = (String::new(), false, 0_usize, 0_u32);
    let mut lines = text.lines().peekable();
    // The first header describes the file, each of the others a segment.
    lines.by_ref().find(|line| line.starts_with(END_OF_HEADER));
    for line in lines {
        let cells: Vec<&str> = line.split(separator).map(str::trim).collect();
        let after = || cells[1..].iter().map(|c| (*c).to_owned()).collect::<Vec<_>>();
        match cells[0] {
            "Channels" => (header, names) = (Header::default(), None),
            "Y_Unit_Label" => header.units = after(),
            "X0" => header.start = after(),
            "Delta_X" => header.step = after(),
            "X_Value" => {
                let channels =
                    cells.iter().skip(1).filter(|c| **c != "Comment" && !c.is_empty() && **c != "X_Value");
                names = Some(channels.map(|c| (*c).to_owned()).collect());
                (segment, row) = (segment + 1, 0);
            }
            _ => {}
        }
        let Some(names) = names.as_ref().filter(|_| cells[0] != "X_Value" && !line.trim().is_empty()) else {
            continue;
        };
        if !has_names {
            out += &first_line(names, &header.units, segments > 1);
            has_names = true;
        }
        let of_row = |texts: &[String]| texts.first().and_then(|t| number(t));
        let time = match has_clock {
            true => number(cells[0]),
            false => Some(
                of_row(&header.start).unwrap_or(0.0) + f64::from(row) * of_row(&header.step).unwrap_or(1.0),
            ),
        };
        let Some(time) = time else { continue };
        let id = if segments > 1 { format!("segment {segment},") } else { String::new() };
        let values = (1..=names.len())
            .map(|k| cells.get(k).and_then(|c| number(c)).map_or(String::new(), |v| v.to_string()));
        out += &format!("{id}{time},{}\n", values.collect::<Vec<_>>().join(","));
        row += 1;
    }
    match row {
        0 => Err(damaged(path, FORMAT, "there are no rows after the header")),
        _ => Ok(out.into_bytes()),
    }
}

/// CSV header of the converted file: the column of segments, the time, and the channels with their units.
fn first_line(names: &[String], units: &[String], has_segments: bool) -> String {
    let symbol = |text: &str| match text.to_lowercase().as_str() {
        "volts" | "volt" => "V".to_owned(),
        "amps" | "amp" | "amperes" => "A".to_owned(),
        "newtons" | "newton" => "N".to_owned(),
        "radians" => "rad".to_owned(),
        _ => text.to_owned(),
    };
    let channels = names.iter().enumerate().map(|(k, name)| match units.get(k).filter(|u| !u.is_empty()) {
        Some(unit) => quoted(&format!("{name} ({})", symbol(unit))),
        None => quoted(name),
    });
    let id = if has_segments { "trajectory," } else { "" };
    format!("{id}time (s),{}\n", channels.collect::<Vec<_>>().join(","))
}
