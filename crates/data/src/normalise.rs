//! Scaling of columns to mean 0 and standard deviation 1.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::summary::Statistics;
use serde::{Deserialize, Serialize};

/// Mean and standard deviation of one column, in the column's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ColumnScale {
    /// Name of the column.
    pub column: String,
    /// Mean of the measured values of the column.
    pub mean: f64,
    /// Standard deviation of the measured values (divisor n); 1 for a column that never changes.
    pub sd: f64,
}

impl ColumnScale {
    /// Scales a value: (value - mean) / sd.
    pub fn apply(&self, value: f64) -> f64 {
        (value - self.mean) / self.sd
    }

    /// Converts a scaled value back: scaled * sd + mean.
    pub fn invert(&self, scaled: f64) -> f64 {
        scaled * self.sd + self.mean
    }
}

/// Means and standard deviations of a list of columns, fitted on training data and stored with the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Normaliser {
    scales: Vec<ColumnScale>,
}

impl Normaliser {
    /// Fits mean and standard deviation of each of `columns` to all measured samples of `train`.
    ///
    /// ```
    /// use augsim_data::{Dataset, Normaliser, Trajectory};
    /// let run = Trajectory::new("a", vec![0.0, 0.1], vec![vec![1.0, 3.0]])?;
    /// let scales = Normaliser::fit(&Dataset::from_names(&["height_m"], vec![run])?, &["height_m"])?;
    /// let height = scales.scale("height_m").unwrap();
    /// assert_eq!((height.mean, height.sd, height.apply(4.0)), (2.0, 1.0, 2.0));
    /// assert_eq!(height.invert(height.apply(4.0)), 4.0);
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    ///
    /// # Errors
    /// A column does not exist or has no measured value.
    pub fn fit(train: &Dataset, columns: &[&str]) -> Result<Self, DataError> {
        let scales = columns.iter().map(|name| fit_column(train, name)).collect::<Result<_, _>>()?;
        Ok(Normaliser { scales })
    }

    /// Mean and standard deviation of each column, in the order of the fitted columns.
    pub fn scales(&self) -> &[ColumnScale] {
        &self.scales
    }

    /// Mean and standard deviation of the column `name`; `None` where it was not fitted.
    pub fn scale(&self, name: &str) -> Option<&ColumnScale> {
        self.scales.iter().find(|scale| scale.column == name)
    }

    /// Scales the samples of trajectory `index`: returns one vector for each fitted column, in fitted order.
    ///
    /// # Errors
    /// The data set lacks one of the columns.
    ///
    /// # Panics
    /// `index` is not below the number of trajectories.
    pub fn apply(&self, dataset: &Dataset, index: usize) -> Result<Vec<Vec<f64>>, DataError> {
        let trajectory = &dataset.trajectories()[index];
        self.scales
            .iter()
            .map(|scale| {
                let samples = trajectory.column(dataset.column_index(&scale.column)?);
                Ok(samples.iter().map(|&v| scale.apply(v)).collect())
            })
            .collect()
    }

    /// Reverts [`apply`](Self::apply) in place; `samples[column][sample]` has the columns in fitted order.
    pub fn invert(&self, samples: &mut [Vec<f64>]) {
        for (scale, column) in self.scales.iter().zip(samples) {
            column.iter_mut().for_each(|v| *v = scale.invert(*v));
        }
    }
}

fn fit_column(train: &Dataset, name: &str) -> Result<ColumnScale, DataError> {
    let column = train.column_index(name)?;
    let values = train.trajectories().iter().flat_map(|t| t.column(column));
    let statistics = Statistics::from_values(values.copied()).ok_or_else(|| DataError::NoMeasuredValues {
        origin: train.origin().clone(),
        column: name.to_owned(),
    })?;
    let sd = if statistics.sd == 0.0 { 1.0 } else { statistics.sd };
    Ok(ColumnScale { column: name.to_owned(), mean: statistics.mean, sd })
}
