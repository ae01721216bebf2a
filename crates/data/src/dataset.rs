//! A data set: trajectories that share columns.

use crate::column::Column;
use crate::error::DataError;
use crate::source::Source;
use crate::trajectory::Trajectory;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Data set: trajectories with the same columns; their lengths and sample times may differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    columns: Vec<Column>,
    trajectories: Vec<Trajectory>,
    origin: Source,
    notes: Vec<String>,
}

impl Dataset {
    /// Creates a data set of `trajectories`, whose values are in the order of `columns`.
    ///
    /// # Errors
    /// A column or trajectory name occurs twice, a trajectory has a different number of columns, or only some
    /// trajectories have a group.
    pub fn new(columns: Vec<Column>, trajectories: Vec<Trajectory>) -> Result<Self, DataError> {
        Self::with_origin(columns, trajectories, Source::Memory)
    }

    /// Like [`Dataset::new`], with the columns given by name, such as `["height_m", "velocity_m_s"]`.
    ///
    /// # Errors
    /// The errors of [`Dataset::new`], and names that do not state a unit.
    pub fn from_names(names: &[&str], trajectories: Vec<Trajectory>) -> Result<Self, DataError> {
        let columns = names.iter().map(|name| Column::new(name)).collect::<Result<Vec<_>, _>>()?;
        Self::new(columns, trajectories)
    }

    pub(crate) fn with_origin(
        columns: Vec<Column>,
        trajectories: Vec<Trajectory>,
        origin: Source,
    ) -> Result<Self, DataError> {
        let mut names = BTreeSet::new();
        if let Some(column) = columns.iter().find(|c| !names.insert(c.name())) {
            return Err(DataError::DuplicateColumn { origin, column: column.name().into() });
        }
        let has_group = trajectories.first().is_some_and(|t| t.group().is_some());
        let mut ids = BTreeSet::new();
        for t in &trajectories {
            let trajectory = t.id().to_owned();
            if !ids.insert(t.id()) {
                return Err(DataError::DuplicateTrajectory { origin, trajectory });
            }
            if t.values().len() != columns.len() {
                let (found, expected) = (t.values().len(), columns.len());
                return Err(DataError::ColumnCount { origin, trajectory, found, expected });
            }
            if t.group().is_some() != has_group {
                return Err(DataError::PartialGroups { origin, trajectory, has_group: !has_group });
            }
        }
        Ok(Dataset { columns, trajectories, origin, notes: Vec::new() })
    }

    /// Columns of values in file order, without trajectory, time and group.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Trajectories of the data set, in file order.
    pub fn trajectories(&self) -> &[Trajectory] {
        &self.trajectories
    }

    /// Path of the file that the data set was read from; `None` for a data set built by code.
    pub fn path(&self) -> Option<&Path> {
        match &self.origin {
            Source::File(path) => Some(path),
            Source::Memory => None,
        }
    }

    /// Origin of the data set (a file, or code), as shown in messages.
    pub fn origin(&self) -> &Source {
        &self.origin
    }

    /// Sets `path` as the origin of the data set.
    pub fn with_path(mut self, path: impl Into<PathBuf>) -> Self {
        self.origin = Source::File(path.into());
        self
    }

    /// Assumptions of the reader about a file that is not in the long form, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Sets the notes on what the reader assumed about the file.
    #[must_use]
    pub(crate) fn with_notes(mut self, notes: Vec<String>) -> Self {
        self.notes = notes;
        self
    }

    /// Copy of the data set with other trajectories and the same columns, origin and notes.
    ///
    /// # Errors
    /// The errors of [`Dataset::new`].
    pub fn with_trajectories(&self, trajectories: Vec<Trajectory>) -> Result<Self, DataError> {
        let other = Self::with_origin(self.columns.clone(), trajectories, self.origin.clone())?;
        Ok(other.with_notes(self.notes.clone()))
    }

    /// Index of the column `name` for [`Trajectory::column`].
    ///
    /// # Errors
    /// There is no such column; the message names the origin and lists the columns.
    pub fn column_index(&self, name: &str) -> Result<usize, DataError> {
        self.columns.iter().position(|c| c.name() == name).ok_or_else(|| DataError::NoSuchColumn {
            origin: self.origin.clone(),
            column: name.to_owned(),
            available: self.columns.iter().map(|c| c.name().to_owned()).collect(),
        })
    }

    /// Whether the data set has a column `name`.
    pub fn has_column(&self, name: &str) -> bool {
        self.columns.iter().any(|c| c.name() == name)
    }

    /// Values of the column `name`, one slice for each trajectory.
    ///
    /// ```
    /// use augsim_data::{Dataset, Trajectory};
    /// let drop = |id: &str, z: f64| Trajectory::new(id, vec![0.0, 0.1], vec![vec![z, z - 0.05]]);
    /// let data = Dataset::from_names(&["height_m"], vec![drop("a", 1.0)?, drop("b", 2.0)?])?;
    /// let first: Vec<f64> = data.series("height_m")?.map(|z| z[0]).collect();
    /// assert_eq!(first, [1.0, 2.0]);
    /// assert!(data.series("x_m").is_err());
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    ///
    /// # Errors
    /// There is no such column.
    pub fn series(&self, name: &str) -> Result<impl Iterator<Item = &[f64]> + '_, DataError> {
        let column = self.column_index(name)?;
        Ok(self.trajectories.iter().map(move |t| t.column(column)))
    }

    /// Columns that are constant within every trajectory, such as mass, drop height or speed set-point.
    ///
    /// ```
    /// use augsim_data::{Dataset, Trajectory};
    /// let ball = Trajectory::new("a", vec![0.0, 0.1], vec![vec![1.0, 0.9], vec![0.058, 0.058]])?;
    /// let data = Dataset::from_names(&["height_m", "mass_kg"], vec![ball])?;
    /// let names: Vec<&str> = data.covariates().map(|column| column.name()).collect();
    /// assert_eq!(names, ["mass_kg"]);
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    pub fn covariates(&self) -> impl Iterator<Item = &Column> + '_ {
        self.columns.iter().enumerate().filter_map(|(i, column)| {
            let is_constant =
                !self.trajectories.is_empty() && self.trajectories.iter().all(|t| t.constant(i).is_some());
            is_constant.then_some(column)
        })
    }

    /// Data set of the trajectories at `indices` only, in that order, with the same columns and origin.
    ///
    /// ```
    /// use augsim_data::{Dataset, Trajectory};
    /// let drop = |id: &str| Trajectory::new(id, vec![0.0], vec![vec![1.0]]);
    /// let data = Dataset::from_names(&["height_m"], vec![drop("a")?, drop("b")?, drop("c")?])?;
    /// let ids: Vec<String> = data.select(&[2, 0]).trajectories().iter().map(|t| t.id().into()).collect();
    /// assert_eq!(ids, ["c", "a"]);
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    ///
    /// # Panics
    /// An index is out of range or occurs twice, which does not happen with a [`Split`](crate::Split).
    pub fn select(&self, indices: &[usize]) -> Dataset {
        let distinct: BTreeSet<usize> = indices.iter().copied().collect();
        assert_eq!(distinct.len(), indices.len(), "a trajectory is selected twice");
        Dataset {
            columns: self.columns.clone(),
            trajectories: indices.iter().map(|&i| self.trajectories[i].clone()).collect(),
            origin: self.origin.clone(),
            notes: self.notes.clone(),
        }
    }
}
