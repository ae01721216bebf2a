//! One recorded run: sample times and, for each column, the values at these times.

use crate::error::DataError;

/// Recording of one run, sampled at strictly increasing, possibly irregular times.
///
/// Values are column-major, one vector of `len()` samples for each column of the data set. Finite numbers are
/// measured values, NaN is a value that was not measured (see [`MissingCells`](crate::MissingCells)), and
/// infinities cannot occur.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    id: String,
    group: Option<String>,
    time_s: Vec<f64>,
    values: Vec<Vec<f64>>,
}

impl Trajectory {
    /// Creates the trajectory `id` with `values[column][sample]` at the times `time_s[sample]`, s.
    ///
    /// ```
    /// use augsim_data::Trajectory;
    /// let drop = Trajectory::new("drop 1", vec![0.0, 0.1], vec![vec![1.0, f64::NAN]])?; // NaN is a gap
    /// assert_eq!((drop.len(), drop.column(0)[0]), (2, 1.0));
    /// assert!(Trajectory::new("drop 2", vec![0.1, 0.1], vec![vec![1.0, 1.0]]).is_err()); // equal times
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    ///
    /// # Errors
    /// There are no samples, lengths differ, times do not increase strictly, values are infinite, or the
    /// identifier would not survive writing and reading back.
    pub fn new(id: impl Into<String>, time_s: Vec<f64>, values: Vec<Vec<f64>>) -> Result<Self, DataError> {
        let id = id.into();
        check_label(&id, &id)?;
        if time_s.is_empty() {
            return Err(DataError::NoSamples { trajectory: id });
        }
        let unordered =
            (0..time_s.len()).find(|&i| !time_s[i].is_finite() || (i > 0 && time_s[i] <= time_s[i - 1]));
        if let Some(sample) = unordered {
            return Err(DataError::BadTime { trajectory: id, sample });
        }
        for (column, samples) in values.iter().enumerate() {
            if samples.len() != time_s.len() {
                return Err(DataError::SampleCount {
                    trajectory: id,
                    column,
                    found: samples.len(),
                    expected: time_s.len(),
                });
            }
            if let Some(sample) = samples.iter().position(|v| v.is_infinite()) {
                return Err(DataError::Infinite { trajectory: id, column, sample });
            }
        }
        Ok(Trajectory { id, group: None, time_s, values })
    }

    /// Sets the group label of the trajectory (such as the ball or the surface).
    ///
    /// # Errors
    /// The label would not survive writing and reading back.
    pub fn with_group(mut self, group: impl Into<String>) -> Result<Self, DataError> {
        let group = group.into();
        check_label(&self.id, &group)?;
        self.group = Some(group);
        Ok(self)
    }

    /// Makes the trajectory a group of its own, labelled by its identifier.
    ///
    /// # Errors
    /// The errors of [`with_group`](Self::with_group).
    pub fn in_own_group(self) -> Result<Self, DataError> {
        let group = self.id.clone();
        self.with_group(group)
    }

    /// Copy of the trajectory with other samples and the same identifier and group.
    ///
    /// # Errors
    /// The errors of [`Trajectory::new`].
    pub fn with_samples(&self, time_s: Vec<f64>, values: Vec<Vec<f64>>) -> Result<Self, DataError> {
        let group = self.group.clone();
        Ok(Trajectory { group, ..Self::new(self.id.clone(), time_s, values)? })
    }

    /// Identifier of the trajectory, unique within a data set.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Group label of the trajectory; `None` where the data set has no groups.
    pub fn group(&self) -> Option<&str> {
        self.group.as_deref()
    }

    /// Sample times of the trajectory, s, strictly increasing.
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Number of samples of the trajectory, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a trajectory is never empty")]
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Values of every column, `[column][sample]`, in the order of the data set's columns.
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// Values of the column with the index `column`.
    ///
    /// [`Dataset::column_index`](crate::Dataset::column_index) gives the index.
    ///
    /// # Panics
    /// `column` is not below the number of columns.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.values[column]
    }

    /// Value of a column that is constant in this trajectory; `None` where it changes or has gaps.
    ///
    /// ```
    /// use augsim_data::Trajectory;
    /// let drop = Trajectory::new("1", vec![0.0, 0.1], vec![vec![0.058, 0.058], vec![1.0, 0.9]])?;
    /// assert_eq!((drop.constant(0), drop.constant(1)), (Some(0.058), None));
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    ///
    /// # Panics
    /// `column` is not below the number of columns.
    pub fn constant(&self, column: usize) -> Option<f64> {
        let samples = self.column(column);
        samples.first().copied().filter(|first| samples.iter().all(|v| v == first))
    }
}

/// Maximum number of bytes of an identifier or a group, which are printed in tables and messages.
const MAX_LABEL_BYTES: usize = 256;

/// Whether `label` survives writing to a file and reading back, and is not too long.
///
/// Spaces at the ends are trimmed when reading, and an empty cell is not a label.
pub(crate) fn is_label(label: &str) -> bool {
    !label.is_empty()
        && label.len() <= MAX_LABEL_BYTES
        && label.trim() == label
        && !label.chars().any(char::is_control)
}

fn check_label(trajectory: &str, label: &str) -> Result<(), DataError> {
    if is_label(label) {
        return Ok(());
    }
    Err(DataError::BadLabel { trajectory: trajectory.to_owned() })
}
