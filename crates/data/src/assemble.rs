//! From rows in long form to trajectories, with the checks that need more than one row.

use crate::column::GROUP;
use crate::error::{DataError, Source};
use crate::limits::Limit;
use crate::trajectory::{Trajectory, is_label};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A trajectory takes as much memory as at least this many samples, however few it has: each of its columns is a
/// list of its own.
const FEWEST_COUNTED: u64 = 8;

/// Collects the rows of a long-form file, trajectory by trajectory.
pub(crate) struct Assembler {
    path: PathBuf,
    id_column: &'static str,
    time_column: &'static str,
    columns: usize,
    finished: Vec<Trajectory>,
    /// Last line of each finished trajectory.
    ended: BTreeMap<String, u64>,
    open: Option<Open>,
    /// Cells so far, with [`FEWEST_COUNTED`] samples for each trajectory, and the most that there may be.
    cells: u64,
    most_cells: u64,
    most_trajectories: u64,
}

struct Open {
    id: String,
    group: Option<String>,
    time_s: Vec<f64>,
    values: Vec<Vec<f64>>,
    last_line: u64,
}

impl Assembler {
    /// `id_column` and `time_column` are the header names, for messages.
    pub(crate) fn new(
        path: PathBuf,
        id_column: &'static str,
        time_column: &'static str,
        columns: usize,
    ) -> Self {
        let (finished, ended) = (Vec::new(), BTreeMap::new());
        let (most_cells, most_trajectories) = (Limit::Cells.value(), Limit::Trajectories.value());
        Assembler {
            path,
            id_column,
            time_column,
            columns,
            finished,
            ended,
            open: None,
            cells: 0,
            most_cells,
            most_trajectories,
        }
    }

    /// Adds the row on `line`.
    pub(crate) fn push(
        &mut self,
        line: u64,
        id: &str,
        group: Option<&str>,
        time_s: f64,
        values: &[f64],
    ) -> Result<(), DataError> {
        if self.open.as_ref().is_some_and(|open| open.id != id) {
            self.close()?;
        }
        if self.open.is_none() {
            self.check_first_row(line, id, group)?;
            self.cells += FEWEST_COUNTED * self.columns as u64;
        }
        self.cells += self.columns as u64;
        if self.cells > self.most_cells {
            return Err(self.exceeded(Limit::Cells));
        }
        let open = self.open.get_or_insert_with(|| Open {
            id: id.to_owned(),
            group: group.map(str::to_owned),
            time_s: Vec::new(),
            values: vec![Vec::new(); self.columns],
            last_line: line,
        });
        if let Some(&previous_s) = open.time_s.last()
            && time_s <= previous_s
        {
            return Err(DataError::TimeNotIncreasing {
                path: self.path.clone(),
                line,
                column: self.time_column,
                trajectory: id.to_owned(),
                previous_s,
                time_s,
            });
        }
        if open.group.as_deref() != group {
            return Err(DataError::GroupChanges {
                path: self.path.clone(),
                line,
                trajectory: id.to_owned(),
                expected: open.group.clone().unwrap_or_default(),
                found: group.unwrap_or_default().to_owned(),
            });
        }
        open.last_line = line;
        open.time_s.push(time_s);
        for (column, &value) in open.values.iter_mut().zip(values) {
            column.push(value);
        }
        Ok(())
    }

    fn check_first_row(&self, line: u64, id: &str, group: Option<&str>) -> Result<(), DataError> {
        for (column, label) in [(self.id_column, Some(id)), (GROUP, group)] {
            if let Some(label) = label.filter(|label| !is_label(label)) {
                return Err(DataError::BadLabelInFile {
                    path: self.path.clone(),
                    line,
                    column,
                    label: label.to_owned(),
                });
            }
        }
        if self.finished.len() as u64 >= self.most_trajectories {
            return Err(self.exceeded(Limit::Trajectories));
        }
        match self.ended.get(id) {
            None => Ok(()),
            Some(&ended_line) => Err(DataError::TrajectoryReappears {
                path: self.path.clone(),
                line,
                column: self.id_column,
                trajectory: id.to_owned(),
                ended_line,
            }),
        }
    }

    fn exceeded(&self, limit: Limit) -> DataError {
        DataError::Limit { origin: Source::File(self.path.clone()), cause: limit.exceeded() }
    }

    fn close(&mut self) -> Result<(), DataError> {
        if let Some(open) = self.open.take() {
            self.ended.insert(open.id.clone(), open.last_line);
            let mut trajectory = Trajectory::new(open.id, open.time_s, open.values)?;
            if let Some(group) = open.group {
                trajectory = trajectory.with_group(group)?;
            }
            self.finished.push(trajectory);
        }
        Ok(())
    }

    /// All trajectories, in file order.
    pub(crate) fn finish(mut self) -> Result<Vec<Trajectory>, DataError> {
        self.close()?;
        if self.finished.is_empty() {
            return Err(DataError::HeaderOnly { path: self.path });
        }
        Ok(self.finished)
    }
}
