//! From the rows of files to trajectories: by name or by restarts of the clock, sorted by time.

use super::dialect::{Sheet, number};
use super::heading::Heading;
use super::roles::Part;
use crate::error::DataError;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Share of steps back in time from which one trajectory is shuffled and not several in a row.
const SHUFFLED: f64 = 0.05;

/// A trajectory in the units of its file.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Draft {
    pub id: String,
    pub group: Option<String>,
    pub times: Vec<f64>,
    /// `values[column][sample]`, NaN where not measured.
    pub values: Vec<Vec<f64>>,
    pub path: PathBuf,
    /// Line of each sample.
    pub lines: Vec<u64>,
}

/// Changes that were made to the rows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Done {
    pub sorted: bool,
    /// Rows that said the same as another one.
    pub repeated: usize,
    /// Trajectories that the clock's restarts told apart.
    pub restarts: bool,
    /// Words that stand for no value.
    pub gap_words: bool,
}

/// One row as numbers.
struct SampledRow {
    line: u64,
    time: f64,
    values: Vec<f64>,
}

/// The trajectories of a file. `stem` is the name of one without a name of its own, and with `prefixed` the beginning of all.
///
/// # Errors
/// A cell that is no number, an empty time, a group that changes, or two different samples at one time.
pub(super) fn drafts(
    sheet: &Sheet,
    headings: &[Heading],
    parts: &[Part],
    stem: &str,
    prefixed: bool,
    done: &mut Done,
) -> Result<Vec<Draft>, DataError> {
    let find = |wanted: &dyn Fn(&Part) -> bool| parts.iter().position(wanted);
    let time_cell = find(&|p| matches!(p, Part::Time(_)));
    let (id_cell, group_cell) = (find(&|p| *p == Part::Trajectory), find(&|p| *p == Part::Group));
    let used = |p: &Part| matches!(p, Part::Axis(..) | Part::Named(..));
    let cells: Vec<usize> = parts.iter().enumerate().filter(|(_, p)| used(p)).map(|(i, _)| i).collect();
    let column = |cell: usize| headings[cell].raw.clone();
    let path = || sheet.path.clone();
    let mut order: Vec<String> = Vec::new();
    let mut by_id: BTreeMap<String, (Option<String>, Vec<SampledRow>)> = BTreeMap::new();
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
        done.gap_words |= cells.iter().zip(&values).any(|(&c, value)| value.is_nan() && !texts[c].is_empty());
        let time = match time_cell {
            None => by_id.values().map(|(_, s)| s.len()).sum::<usize>() as f64,
            Some(cell) => match read(cell)? {
                Some(time) => time,
                None if values.iter().all(|v| v.is_nan()) => continue,
                None => {
                    let (column, remedy) = (column(cell), "every sample needs its time");
                    return Err(DataError::EmptyCell { path: path(), line, column, remedy });
                }
            },
        };
        let id = match id_cell {
            None => stem.to_owned(),
            Some(cell) if texts[cell].is_empty() => {
                let (column, remedy) = (column(cell), "every row needs it");
                return Err(DataError::EmptyCell { path: path(), line, column, remedy });
            }
            Some(cell) if prefixed => format!("{stem}/{}", texts[cell]),
            Some(cell) => texts[cell].clone(),
        };
        let group = group_cell.map(|cell| texts[cell].clone()).filter(|g| !g.is_empty());
        if !by_id.contains_key(&id) {
            order.push(id.clone());
        }
        let (first, samples) = by_id.entry(id.clone()).or_insert_with(|| (group.clone(), Vec::new()));
        if *first != group {
            let (expected, found) = (first.clone().unwrap_or_default(), group.unwrap_or_default());
            return Err(DataError::GroupChanges { path: path(), line, trajectory: id, expected, found });
        }
        samples.push(SampledRow { line, time, values });
    }
    let mut out = Vec::new();
    for id in order {
        let Some((group, samples)) = by_id.remove(&id) else { continue };
        for (id, mut samples) in parts_of(id, samples, id_cell.is_none(), done) {
            if samples.windows(2).any(|w| w[1].time < w[0].time) {
                samples.sort_by(|a, b| a.time.total_cmp(&b.time));
                done.sorted = true;
            }
            let before = samples.len();
            samples.dedup_by(|b, a| a.time == b.time && same(&a.values, &b.values));
            done.repeated += before - samples.len();
            if let Some(w) = samples.windows(2).find(|w| w[0].time == w[1].time) {
                let (previous_s, time_s) = (w[0].time, w[1].time);
                let (line, trajectory) = (w[1].line.max(w[0].line), id);
                let column = "time";
                return Err(DataError::TimeNotIncreasing {
                    path: path(),
                    line,
                    column,
                    trajectory,
                    previous_s,
                    time_s,
                });
            }
            out.push(Draft {
                id,
                group: group.clone(),
                times: samples.iter().map(|s| s.time).collect(),
                values: (0..cells.len()).map(|c| samples.iter().map(|s| s.values[c]).collect()).collect(),
                path: path(),
                lines: samples.iter().map(|s| s.line).collect(),
            });
        }
    }
    Ok(out)
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(x, y)| x == y || (x.is_nan() && y.is_nan()))
}

/// The samples cut where the clock starts anew, if nothing names the trajectories.
fn parts_of(
    id: String,
    samples: Vec<SampledRow>,
    unnamed: bool,
    done: &mut Done,
) -> Vec<(String, Vec<SampledRow>)> {
    let back = samples.windows(2).filter(|w| w[1].time < w[0].time).count();
    if !unnamed || back == 0 || back as f64 > SHUFFLED * samples.len() as f64 {
        return vec![(id, samples)];
    }
    done.restarts = true;
    let mut out: Vec<(String, Vec<SampledRow>)> = Vec::new();
    for sample in samples {
        let goes_on = out.last().and_then(|(_, s)| s.last()).is_some_and(|last| sample.time >= last.time);
        match out.last_mut() {
            Some((_, current)) if goes_on => current.push(sample),
            _ => out.push((format!("{id}-{}", out.len() + 1), vec![sample])),
        }
    }
    out
}
