//! Assumptions of the sniffing, in words.

use super::recording::{Recorded, Target};
use super::roles::Part;
use super::rows::{Done, Draft};
use crate::printable::{shown, shown_list};
use crate::statistics::digits;

pub(super) fn layout(file: &Recorded) -> String {
    let dialect = file.sheet.dialect;
    let separator = match dialect.separator {
        ' ' => "blanks".to_owned(),
        '\t' => "tabs".to_owned(),
        c => format!("`{c}`"),
    };
    let mark = if dialect.decimal == ',' { "commas" } else { "points" };
    let mut text = format!("cells are separated by {separator}, decimals have {mark}");
    if file.sheet.names.is_none() {
        text += ", there is no header";
    }
    if let Some(encoding) = file.sheet.comments.iter().find_map(|c| c.strip_prefix("encoding ")) {
        text += &format!(", encoding {encoding}");
    }
    match file.sheet.passed_over {
        0 => {}
        n => text += &format!(", {n} lines before the header were passed over"),
    }
    text
}

pub(super) fn columns_assumed(file: &Recorded, columns: &[Target]) -> Vec<String> {
    let mut pairs = Vec::new();
    for (h, p) in file.headings.iter().zip(&file.parts) {
        match p {
            Part::Trajectory if h.raw != "trajectory" => {
                pairs.push(format!("{} is the trajectory", shown(&h.raw)))
            }
            Part::Time(_) if h.raw != "t_s" => pairs.push(format!("{} is the time", shown(&h.raw))),
            _ => {}
        }
    }
    let renamed = columns.iter().filter(|c| c.from != c.name || c.factor != 1.0);
    pairs.extend(renamed.map(|c| match c.factor {
        1.0 => format!("{} is {}", shown(&c.from), c.name),
        f => format!("{} times {} is {}", shown(&c.from), digits(f), c.name),
    }));
    let extra: Vec<&str> = file
        .headings
        .iter()
        .zip(&file.parts)
        .filter(|(h, p)| **p == Part::Extra && !h.raw.is_empty())
        .map(|(h, _)| h.raw.as_str())
        .collect();
    let mut out = Vec::new();
    if !pairs.is_empty() {
        out.push(pairs.join(", "));
    }
    if !extra.is_empty() {
        out.push(format!("left out: {}", shown_list(&extra)));
    }
    out
}

pub(super) fn rows_assumed(files: &[Recorded], all: &[Draft], done: Done) -> Vec<String> {
    let mut out = Vec::new();
    if files.len() > 1 {
        out.push(format!("{} files, {} trajectories", files.len(), all.len()));
    }
    if done.restarts {
        out.push(format!("the clock starts anew {} times: so many trajectories", all.len()));
    }
    if done.sorted {
        out.push("rows were sorted by time".to_owned());
    }
    if done.repeated > 0 {
        out.push(format!("{} rows that repeat another one were left out", done.repeated));
    }
    if done.gap_words {
        out.push("words such as nan and NA are gaps".to_owned());
    }
    out
}
