//! Groups the rows of a file into trajectories, by identifier or at restarts of the clock.

use super::calendar::Written;
use super::clock::read_times;
use super::dialect::number;
use super::recording::RecordedFile;
use super::roles::Role;
use crate::error::{DataError, EVERY_ROW_NEEDS_A_VALUE, EVERY_SAMPLE_NEEDS_A_TIME};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Maximum share of rows whose time goes back, for each of them to begin a new trajectory.
///
/// With more such rows, the file is one trajectory with unsorted rows.
const MAX_RESTART_SHARE: f64 = 0.05;

/// Trajectory as it is read, in the units of the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Draft {
    pub id: String,
    pub group: Option<String>,
    pub times: Vec<f64>,
    /// Form of the times in the file: numbers, dates or clock times.
    pub written: Written,
    /// Values of the trajectory, `[column][sample]`; NaN where a value was not measured.
    pub values: Vec<Vec<f64>>,
    pub path: PathBuf,
    /// Line number in the file of each sample.
    pub lines: Vec<u64>,
}

/// Changes that the reader made to the rows of the files, for the notes to the user.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct RowChanges {
    /// Whether rows were sorted by time.
    pub sorted: bool,
    /// Number of rows that were left out because they repeat another row.
    pub repeated_rows: usize,
    /// Whether rows were split into trajectories at restarts of the clock.
    pub has_restarts: bool,
    /// Whether words such as `nan` were read as gaps.
    pub has_gap_words: bool,
}

/// One row of a table as numbers, in the units of the file.
struct SampledRow {
    line: u64,
    time: f64,
    values: Vec<f64>,
}

/// Rows with the same trajectory identifier, in file order.
struct NamedRows {
    id: String,
    group: Option<String>,
    rows: Vec<SampledRow>,
}

/// Reads the trajectories of a file, with values in the units of the file.
///
/// `stem` is the identifier of a trajectory without one; with `prefixed` it precedes the identifiers in the
/// file.
///
/// # Errors
/// A cell is not a number, a time or an identifier is empty, a group changes, or two different samples have
/// the same time.
pub(super) fn read_drafts(
    file: &RecordedFile,
    stem: &str,
    prefixed: bool,
    changes: &mut RowChanges,
) -> Result<Vec<Draft>, DataError> {
    let sheet = &file.sheet;
    let has_ids = file.roles.contains(&Role::Trajectory);
    let path = || sheet.path.clone();
    let mut out = Vec::new();
    let (named, written) = rows_by_id(file, stem, prefixed, changes)?;
    for NamedRows { id, group, rows } in named {
        for (id, mut rows) in split_at_restarts(id, rows, !has_ids, changes) {
            if rows.windows(2).any(|w| w[1].time < w[0].time) {
                rows.sort_by(|a, b| a.time.total_cmp(&b.time));
                changes.sorted = true;
            }
            let count = rows.len();
            rows.dedup_by(|b, a| a.time == b.time && are_same(&a.values, &b.values));
            changes.repeated_rows += count - rows.len();
            if let Some(w) = rows.windows(2).find(|w| w[0].time == w[1].time) {
                return Err(DataError::TimeNotIncreasing {
                    path: path(),
                    line: w[1].line.max(w[0].line),
                    column: "time",
                    trajectory: id,
                    previous_s: w[0].time,
                    time_s: w[1].time,
                });
            }
            let columns = rows.first().map_or(0, |row| row.values.len());
            out.push(Draft {
                id,
                group: group.clone(),
                times: rows.iter().map(|s| s.time).collect(),
                written,
                values: (0..columns).map(|c| rows.iter().map(|s| s.values[c]).collect()).collect(),
                path: path(),
                lines: rows.iter().map(|s| s.line).collect(),
            });
        }
    }
    Ok(out)
}

/// Reads all rows as numbers and groups them by identifier, in the order of first appearance.
///
/// Also returns the form of the times: numbers, dates or clock times.
fn rows_by_id(
    file: &RecordedFile,
    stem: &str,
    prefixed: bool,
    changes: &mut RowChanges,
) -> Result<(Vec<NamedRows>, Written), DataError> {
    let RecordedFile { sheet, headings, roles } = file;
    let find = |is_wanted: &dyn Fn(&Role) -> bool| roles.iter().position(is_wanted);
    let time_cell = find(&|role| matches!(role, Role::Time(_)));
    let (id_cell, group_cell) = (find(&|role| *role == Role::Trajectory), find(&|role| *role == Role::Group));
    let is_value = |role: &Role| matches!(role, Role::Axis(..) | Role::Named(..));
    let cells: Vec<usize> = (0..roles.len()).filter(|&i| is_value(&roles[i])).collect();
    let column = |cell: usize| headings[cell].raw.clone();
    let path = || sheet.path.clone();
    let times = time_cell.map(|cell| read_times(sheet, cell, &headings[cell].raw)).transpose()?;
    let written = times.as_ref().map_or(Written::Number, |times| times.written);
    let mut out: Vec<NamedRows> = Vec::new();
    let mut index_of_id: BTreeMap<String, usize> = BTreeMap::new();
    let mut row_count = 0;
    for row in 0..sheet.rows() {
        let (line, texts) = (sheet.lines[row], sheet.row(row));
        let read = |cell: usize| {
            number(&texts[cell], sheet.dialect.decimal).map_err(|()| DataError::BadNumber {
                path: path(),
                line,
                column: column(cell),
                cell: texts[cell].clone(),
            })
        };
        let values: Vec<f64> =
            cells.iter().map(|&c| Ok(read(c)?.unwrap_or(f64::NAN))).collect::<Result<_, DataError>>()?;
        changes.has_gap_words |=
            cells.iter().zip(&values).any(|(&c, value)| value.is_nan() && !texts[c].is_empty());
        let time = match time_cell.zip(times.as_ref()) {
            None => row_count as f64,
            Some((cell, times)) => match times.values[row] {
                Some(time) => time,
                None if values.iter().all(|v| v.is_nan()) => continue,
                None => {
                    let (column, remedy) = (column(cell), EVERY_SAMPLE_NEEDS_A_TIME);
                    return Err(DataError::EmptyCell { path: path(), line, column, remedy });
                }
            },
        };
        let id = match id_cell {
            None => stem.to_owned(),
            Some(cell) if texts[cell].is_empty() => {
                let (column, remedy) = (column(cell), EVERY_ROW_NEEDS_A_VALUE);
                return Err(DataError::EmptyCell { path: path(), line, column, remedy });
            }
            Some(cell) if prefixed => format!("{stem}/{}", texts[cell]),
            Some(cell) => texts[cell].clone(),
        };
        let group = group_cell.map(|cell| texts[cell].clone()).filter(|g| !g.is_empty());
        let index = *index_of_id.entry(id.clone()).or_insert(out.len());
        if index == out.len() {
            out.push(NamedRows { id: id.clone(), group: group.clone(), rows: Vec::new() });
        }
        let named = &mut out[index];
        if named.group != group {
            let (expected, found) = (named.group.clone().unwrap_or_default(), group.unwrap_or_default());
            return Err(DataError::GroupChanges { path: path(), line, trajectory: id, expected, found });
        }
        named.rows.push(SampledRow { line, time, values });
        row_count += 1;
    }
    Ok((out, written))
}

/// Whether two rows have the same values; gaps (NaN) in both count as equal.
fn are_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(x, y)| x == y || (x.is_nan() && y.is_nan()))
}

/// Splits rows without identifiers into trajectories where the time decreases.
///
/// Where the time decreases often, the rows are one unsorted trajectory.
fn split_at_restarts(
    id: String,
    rows: Vec<SampledRow>,
    is_unnamed: bool,
    changes: &mut RowChanges,
) -> Vec<(String, Vec<SampledRow>)> {
    let restarts = rows.windows(2).filter(|w| w[1].time < w[0].time).count();
    if !is_unnamed || restarts == 0 || restarts as f64 > MAX_RESTART_SHARE * rows.len() as f64 {
        return vec![(id, rows)];
    }
    changes.has_restarts = true;
    let mut out: Vec<(String, Vec<SampledRow>)> = Vec::new();
    for row in rows {
        let continues = out.last().and_then(|(_, s)| s.last()).is_some_and(|last| row.time >= last.time);
        match out.last_mut() {
            Some((_, current)) if continues => current.push(row),
            _ => out.push((format!("{id}-{}", out.len() + 1), vec![row])),
        }
    }
    out
}
