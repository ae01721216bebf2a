//! Notes for the user about what the reader of unknown layouts assumed.

use super::recording::{RecordedFile, Target};
use super::roles::Role;
use super::rows::{Draft, RowChanges};
use crate::column::Column;
use crate::error::ColumnError;
use crate::escape_control_characters::{escaped_list, escaped_short};
use crate::foreign::NOTE_MARK;
use crate::statistics::digits;

/// Note for the user about the inferred separator, decimal mark, header and encoding.
pub(super) fn layout_note(file: &RecordedFile) -> String {
    let dialect = file.sheet.dialect;
    let separator = match dialect.separator {
        ' ' => "spaces".to_owned(),
        '\t' => "tabs".to_owned(),
        '\n' => "line ends".to_owned(),
        c => format!("`{c}`"),
    };
    let mark = if dialect.decimal == ',' { "commas" } else { "points" };
    let mut text = format!("cells are separated by {separator}, decimals use {mark}");
    if file.sheet.names.is_none() {
        text += ", there is no header";
    }
    if let Some(encoding) = file.sheet.comments.iter().find_map(|c| c.strip_prefix("encoding ")) {
        text += &format!(", the encoding is {encoding}");
    }
    for note in file.sheet.comments.iter().filter_map(|c| c.strip_prefix(NOTE_MARK)) {
        text += &format!(", {}", escaped_short(note));
    }
    match file.sheet.skipped_lines {
        0 => {}
        n => text += &format!(", {n} lines before the header were skipped"),
    }
    text
}

/// Notes for the user about the inferred meaning of the columns and about columns that are not used.
pub(super) fn column_notes(file: &RecordedFile, columns: &[Target]) -> Vec<String> {
    let mut pairs = Vec::new();
    for (h, role) in file.headings.iter().zip(&file.roles) {
        match role {
            Role::Trajectory if h.raw != "trajectory" => {
                pairs.push(format!("{} is the trajectory identifier", escaped_short(&h.raw)))
            }
            Role::Time(_) if h.raw != "t_s" => pairs.push(format!("{} is the time", escaped_short(&h.raw))),
            _ => {}
        }
    }
    let renamed = columns.iter().filter(|c| c.from != c.name || c.factor != 1.0 || c.offset != 0.0);
    pairs.extend(renamed.map(|c| match c.factor {
        f if c.offset != 0.0 => {
            format!("{} times {} plus {} is {}", escaped_short(&c.from), digits(f), digits(c.offset), c.name)
        }
        1.0 => format!("{} is {}", escaped_short(&c.from), c.name),
        f => format!("{} times {} is {}", escaped_short(&c.from), digits(f), c.name),
    }));
    let unused: Vec<&str> = file
        .headings
        .iter()
        .zip(&file.roles)
        .filter(|(h, role)| **role == Role::Unused && !h.raw.is_empty())
        .map(|(h, _)| h.raw.as_str())
        .collect();
    let is_unknown = |c: &&Target| matches!(Column::new(&c.name), Err(ColumnError::UnknownUnit { .. }));
    let unknown: Vec<&str> = columns.iter().filter(is_unknown).map(|c| c.name.as_str()).collect();
    let mut out = Vec::new();
    if !pairs.is_empty() {
        out.push(pairs.join(", "));
    }
    if !unknown.is_empty() {
        let verb = if unknown.len() == 1 { "states" } else { "state" };
        out.push(format!("{} {verb} no known unit; the values are kept as they are", escaped_list(&unknown)));
    }
    if !unused.is_empty() {
        out.push(format!("columns not used: {} (no numbers)", escaped_list(&unused)));
    }
    out
}

/// Notes for the user about the division of the rows into trajectories and about changes to the rows.
pub(super) fn row_notes(files: &[RecordedFile], drafts: &[Draft], changes: RowChanges) -> Vec<String> {
    let mut out = Vec::new();
    if files.len() > 1 {
        out.push(format!("{} files, {} trajectories", files.len(), drafts.len()));
    }
    if changes.has_restarts {
        out.push(format!("the clock restarts, so the rows are split into {} trajectories", drafts.len()));
    }
    if changes.sorted {
        out.push("rows were sorted by time".to_owned());
    }
    if changes.repeated_rows > 0 {
        out.push(format!("{} rows that repeat another row were left out", changes.repeated_rows));
    }
    if changes.has_gap_words {
        out.push("words such as nan and NA are read as gaps".to_owned());
    }
    out
}
