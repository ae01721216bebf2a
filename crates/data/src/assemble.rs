//! Groups rows in long form into trajectories and checks the order of rows, times and groups.

use crate::column::GROUP;
use crate::error::DataError;
use crate::limits::Limit;
use crate::source::Source;
use crate::trajectory::{Trajectory, is_label};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Number of samples that are added per trajectory when its cells are counted for the limit on cells.
///
/// A short trajectory takes as much memory as this many samples, because each of its columns is a separate
/// vector.
const MIN_COUNTED_SAMPLES: u64 = 8;

/// Collects the rows of a file in long form into trajectories.
pub(crate) struct Assembler {
    path: PathBuf,
    id_column: &'static str,
    time_column: &'static str,
    columns: usize,
    finished: Vec<Trajectory>,
    /// Number of the last line of each finished trajectory, by trajectory identifier.
    ended: BTreeMap<String, u64>,
    open: Option<OpenTrajectory>,
    /// Number of cells read so far, with [`MIN_COUNTED_SAMPLES`] extra samples for each trajectory.
    cells: u64,
    max_cells: u64,
    max_trajectories: u64,
}

/// The trajectory whose rows are being read.
struct OpenTrajectory {
    id: String,
    group: Option<String>,
    time_s: Vec<f64>,
    values: Vec<Vec<f64>>,
    last_line: u64,
}

impl Assembler {
    /// Creates an assembler for rows of `columns` values; `id_column` and `time_column` are names for messages.
    pub(crate) fn new(
        path: PathBuf,
        id_column: &'static str,
        time_column: &'static str,
        columns: usize,
    ) -> Self {
        let (finished, ended) = (Vec::new(), BTreeMap::new());
        let (max_cells, max_trajectories) = (Limit::Cells.value(), Limit::Trajectories.value());
        Assembler {
            path,
            id_column,
            time_column,
            columns,
            finished,
            ended,
            open: None,
            cells: 0,
            max_cells,
            max_trajectories,
        }
    }

    /// Adds the row on line `line` to its trajectory.
    ///
    /// # Errors
    /// The time does not increase, the group changes, the trajectory ended before, or a limit is exceeded.
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
            self.cells += MIN_COUNTED_SAMPLES * self.columns as u64;
        }
        self.cells += self.columns as u64;
        if self.cells > self.max_cells {
            return Err(self.exceeded(Limit::Cells));
        }
        let open = self.open.get_or_insert_with(|| OpenTrajectory {
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

    /// Checks the first row of a trajectory: its labels, that its name is new, and the number of trajectories.
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
        if self.finished.len() as u64 >= self.max_trajectories {
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

    /// Ends the trajectory whose rows are being read and adds it to the finished ones.
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

    /// Returns all trajectories that were read, in file order.
    ///
    /// # Errors
    /// There were no rows.
    pub(crate) fn finish(mut self) -> Result<Vec<Trajectory>, DataError> {
        self.close()?;
        if self.finished.is_empty() {
            return Err(DataError::HeaderOnly { path: self.path });
        }
        Ok(self.finished)
    }
}
