//! Trajectories as the nets see them: equal columns, no gaps, row-major in time.

use crate::TrainerError;
use augsim_data::Dataset;

/// One trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Identifier in the data set.
    pub id: String,
    /// Number of samples T.
    pub time: usize,
    /// States `[T, S]`, in the units of the columns.
    pub states: Vec<f64>,
}

impl Sequence {
    /// State at sample `t`.
    pub fn state(&self, t: usize) -> &[f64] {
        let s = self.states.len() / self.time;
        &self.states[t * s..(t + 1) * s]
    }
}

/// Trajectories with the same state columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequences {
    /// Names of the state columns, with units.
    pub columns: Vec<String>,
    /// The trajectories.
    pub items: Vec<Sequence>,
}

impl Sequences {
    /// The named columns of a data set.
    ///
    /// # Errors
    /// A column is missing, a sample has a gap, a trajectory has fewer than two samples, or there is no
    /// trajectory.
    pub fn new(dataset: &Dataset, columns: &[&str]) -> Result<Self, TrainerError> {
        let indices = columns.iter().map(|c| dataset.column_index(c)).collect::<Result<Vec<_>, _>>()?;
        let mut items = Vec::with_capacity(dataset.trajectories().len());
        for t in dataset.trajectories() {
            if t.len() < 2 {
                return Err(TrainerError::TooShort { id: t.id().to_owned(), samples: t.len() });
            }
            let mut states = Vec::with_capacity(t.len() * columns.len());
            for sample in 0..t.len() {
                for (&index, name) in indices.iter().zip(columns) {
                    let value = t.column(index)[sample];
                    if value.is_nan() {
                        let (id, column) = (t.id().to_owned(), (*name).to_owned());
                        return Err(TrainerError::Gap { id, column, sample });
                    }
                    states.push(value);
                }
            }
            items.push(Sequence { id: t.id().to_owned(), time: t.len(), states });
        }
        if items.is_empty() {
            return Err(TrainerError::NoTrajectories { what: "the data set" });
        }
        Ok(Sequences { columns: columns.iter().map(|c| (*c).to_owned()).collect(), items })
    }

    /// Number of state columns S.
    pub fn state_dim(&self) -> usize {
        self.columns.len()
    }
}
