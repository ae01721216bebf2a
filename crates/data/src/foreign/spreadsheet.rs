//! Reads the sheet with the most numbers of an Excel workbook (`.xlsx`).

use super::{NOTE_MARK, check_cells, damaged, quoted};
use crate::error::DataError;
use crate::limits::Limit;
use crate::push::archive::unpack;
use crate::sniff::Unrecognised;
use calamine::{DataRef, ExcelDateTime, Reader, Xlsx};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

const FORMAT: &str = "an Excel workbook";

/// Texts of the cells of a sheet, by (row, column).
type Cells = BTreeMap<(u32, u32), String>;

/// Converts the sheet of an Excel workbook with the most numbers to CSV text.
///
/// # Errors
/// The workbook is damaged, no sheet has numbers, or a limit is exceeded.
pub(super) fn text(path: &Path, bytes: Vec<u8>, names: &[String]) -> Result<Vec<u8>, DataError> {
    // The parts are unpacked once to check their sizes, which the reader of the workbook does not limit.
    unpack(path, &bytes, names, |_, _| Ok(()))?;
    let mut book: Xlsx<_> = Xlsx::new(Cursor::new(bytes)).map_err(|e| damaged(path, FORMAT, e))?;
    let sheets = book.sheet_names();
    let mut best: Option<(usize, &String, Cells)> = None;
    for sheet in &sheets {
        // A sheet may be a chart, which has no cells.
        let Some((numbers, cells)) = cells(path, &mut book, sheet)? else { continue };
        if numbers > best.as_ref().map_or(0, |b| b.0) {
            best = Some((numbers, sheet, cells));
        }
    }
    let Some((_, sheet, cells)) = best else {
        return Err(super::refused(path, Unrecognised::NoVectors { format: FORMAT, names: sheets }));
    };
    let mut out = String::new();
    if sheets.len() > 1 {
        out += &format!("# {NOTE_MARK}read from the sheet {sheet}, which has the most numbers\n");
    }
    let first_column = cells.keys().map(|(_, column)| *column).min().unwrap_or(0);
    let last_column = cells.keys().map(|(_, column)| *column).max().unwrap_or(0);
    let mut rows: Vec<u32> = cells.keys().map(|(row, _)| *row).collect();
    rows.dedup();
    check_cells(path, rows.len() as u64 * u64::from(last_column - first_column + 1))?;
    for row in rows {
        let line =
            (first_column..=last_column).map(|c| cells.get(&(row, c)).map_or(String::new(), |t| quoted(t)));
        out += &(line.collect::<Vec<_>>().join(",") + "\n");
    }
    Ok(out.into_bytes())
}

/// Number of cells of a sheet that hold numbers, and all its cells; `None` where it is no worksheet.
fn cells(
    path: &Path,
    book: &mut Xlsx<Cursor<Vec<u8>>>,
    sheet: &str,
) -> Result<Option<(usize, Cells)>, DataError> {
    let Ok(mut reader) = book.worksheet_cells_reader(sheet) else { return Ok(None) };
    let (mut out, mut numbers) = (Cells::new(), 0);
    while let Some(cell) = reader.next_cell().map_err(|e| damaged(path, FORMAT, e))? {
        let text = match cell.get_value() {
            DataRef::Empty => continue,
            DataRef::Int(value) => value.to_string(),
            DataRef::Float(value) => value.to_string(),
            DataRef::String(text) => text.clone(),
            DataRef::SharedString(text) => (*text).to_owned(),
            DataRef::Bool(value) => u8::from(*value).to_string(),
            DataRef::DateTime(time) => clock_text(*time),
            DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => text.clone(),
            // An error such as #N/A is a value that was not measured.
            DataRef::Error(_) => continue,
        };
        numbers += usize::from(text.trim().parse::<f64>().is_ok_and(f64::is_finite));
        let (row, column) = cell.get_position();
        Limit::Columns.check(u64::from(column)).map_err(|_| too_wide(path))?;
        out.insert((row, column), text);
        check_cells(path, out.len() as u64)?;
    }
    Ok(Some((numbers, out)))
}

fn too_wide(path: &Path) -> DataError {
    let origin = crate::source::Source::File(path.to_owned());
    DataError::Limit { origin, cause: Limit::Columns.exceeded() }
}

/// Text of an Excel time: an ISO date with time, or `hh:mm:ss.fff` for a duration or a time of day.
fn clock_text(time: ExcelDateTime) -> String {
    let (year, month, day, hour, minute, second, milli) = time.to_ymd_hms_milli();
    // A workbook counts days from 1900; a time of day has no date.
    match time.as_f64() < 1.0 {
        true => format!("{hour:02}:{minute:02}:{second:02}.{milli:03}"),
        false => format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{milli:03}"),
    }
}
