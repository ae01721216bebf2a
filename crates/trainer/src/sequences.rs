//! Trajectories prepared for the nets: equal columns, no gaps, row-major in time.

use crate::TrainerError;
use augsim_data::Dataset;

/// Action column that stands for the sample time, which a data set does not store as a column.
const TIME_COLUMN: &str = "t_s";

/// One trajectory: states and actions at all samples, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Identifier of the trajectory in the data set.
    pub id: String,
    /// Number of samples T of the trajectory.
    pub time: usize,
    /// States `[T, S]` (T samples, S state columns), in the units of the columns.
    pub states: Vec<f64>,
    /// Actions `[T, A]` (T samples, A action columns), known in advance; empty for systems without actions.
    pub actions: Vec<f64>,
}

impl Sequence {
    /// State at sample `t`, one value per state column.
    pub fn state(&self, t: usize) -> &[f64] {
        let s = self.states.len() / self.time;
        &self.states[t * s..(t + 1) * s]
    }

    /// Action at sample `t`, one value per action column; empty for systems without actions.
    pub fn action(&self, t: usize) -> &[f64] {
        let a = self.actions.len() / self.time;
        &self.actions[t * a..(t + 1) * a]
    }
}

/// Trajectories with the same state and action columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequences {
    /// Names of the state columns, with units.
    pub columns: Vec<String>,
    /// Names of the action columns, with units; `t_s` is the time of the sample.
    pub action_columns: Vec<String>,
    /// The trajectories, in the order of the data set.
    pub items: Vec<Sequence>,
}

impl Sequences {
    /// Extracts the named state columns of a data set, without actions.
    ///
    /// # Errors
    /// As [`Sequences::with_actions`].
    pub fn new(dataset: &Dataset, columns: &[&str]) -> Result<Self, TrainerError> {
        Self::with_actions(dataset, columns, &[])
    }

    /// Extracts the named state and action columns of a data set.
    ///
    /// # Errors
    /// [`TrainerError`] if a column or a value is missing, a trajectory has fewer than two samples, or there
    /// is no trajectory.
    pub fn with_actions(dataset: &Dataset, columns: &[&str], actions: &[&str]) -> Result<Self, TrainerError> {
        // The time is stored apart from the columns, hence `None`.
        let index = |name: &&str| (*name != TIME_COLUMN).then(|| dataset.column_index(name)).transpose();
        let indices = columns.iter().map(index).collect::<Result<Vec<_>, _>>()?;
        let action_indices = actions.iter().map(index).collect::<Result<Vec<_>, _>>()?;
        let mut items = Vec::with_capacity(dataset.trajectories().len());
        for t in dataset.trajectories() {
            if t.len() < 2 {
                return Err(TrainerError::TooShort { id: t.id().to_owned(), samples: t.len() });
            }
            let rows = |indices: &[Option<usize>], names: &[&str]| {
                let mut rows = Vec::with_capacity(t.len() * names.len());
                for sample in 0..t.len() {
                    for (index, name) in indices.iter().zip(names) {
                        let value = index.map_or(t.time_s()[sample], |i| t.column(i)[sample]);
                        if value.is_nan() {
                            let (id, column) = (t.id().to_owned(), (*name).to_owned());
                            return Err(TrainerError::Gap { id, column, sample });
                        }
                        rows.push(value);
                    }
                }
                Ok(rows)
            };
            let states = rows(&indices, columns)?;
            let actions = rows(&action_indices, actions)?;
            items.push(Sequence { id: t.id().to_owned(), time: t.len(), states, actions });
        }
        if items.is_empty() {
            return Err(TrainerError::NoTrajectories { what: "the data set" });
        }
        let owned = |names: &[&str]| names.iter().map(|c| (*c).to_owned()).collect();
        Ok(Sequences { columns: owned(columns), action_columns: owned(actions), items })
    }

    /// Keeps only the first sample of every trajectory.
    pub fn first_row(&self) -> Self {
        let first = |q: &Sequence| Sequence {
            id: q.id.clone(),
            time: 1,
            states: q.state(0).to_vec(),
            actions: q.action(0).to_vec(),
        };
        Sequences { items: self.items.iter().map(first).collect(), ..self.clone() }
    }

    /// Number of state columns S.
    pub fn state_dim(&self) -> usize {
        self.columns.len()
    }
}
