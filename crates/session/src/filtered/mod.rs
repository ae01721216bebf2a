//! Filtered forecasts: predictions after a particle filter has observed the first samples.

mod net;
mod observed_columns;
mod system;

pub use crate::prefix_length::PrefixLength;
pub use net::{NetOnPrefix, net_on_prefix};
pub use observed_columns::ObservedColumns;
pub use system::{SystemOnPrefix, built_in_on_prefix, system_on_prefix};

use crate::Usage;
use crate::forecast::{check_size, summarised};
use crate::usage::PrefixFault;
use augsim_data::Dataset;
use augsim_trainer::filter::{FilterSettings, InitialStatePrior, Prefix, PrefixForecaster, Sensor};
use augsim_trainer::{Samples, Sequences, TrainerError, collect_in_order};
use rayon::prelude::*;

/// Default number of particles of the filter.
pub const PARTICLES: usize = 256;

/// Measured trajectories with the times of their samples in s.
#[derive(Debug, Clone)]
pub struct TimedSequences {
    /// Values of the trajectories; NaN where a value was not measured.
    pub set: Sequences,
    /// Times of the samples, s, `[trajectory][sample]`.
    pub times: Vec<Vec<f64>>,
}

impl TimedSequences {
    /// Number of observed rows of each trajectory for each prefix, `[trajectory][prefix]`.
    ///
    /// # Errors
    /// A prefix without a row, one that is not longer than the previous one, or one that leaves no trajectory
    /// anything to predict.
    pub fn lengths(&self, seen: &[PrefixLength]) -> Result<Vec<Vec<usize>>, Usage> {
        let rows_of = |times: &Vec<f64>| seen.iter().map(|s| s.rows(times)).collect::<Vec<_>>();
        let lengths: Vec<Vec<usize>> = self.times.iter().map(rows_of).collect();
        let longest = self.times.iter().map(Vec::len).max().unwrap_or(0);
        for (k, prefix) in seen.iter().enumerate() {
            let rows = |lengths: &Vec<usize>| lengths[k];
            if lengths.iter().map(rows).all(|n| n == 0) {
                return Err(Usage::Prefix(PrefixFault::NoRow { seen: *prefix }));
            }
            if lengths.iter().zip(&self.times).all(|(l, times)| l[k] >= times.len()) {
                return Err(Usage::Prefix(PrefixFault::AllOfLongest { seen: *prefix, samples: longest }));
            }
            if k > 0 && lengths.iter().any(|l| l[k] <= l[k - 1] && l[k - 1] > 0) {
                let before = seen[k - 1];
                return Err(Usage::Prefix(PrefixFault::NotLonger { before, seen: *prefix }));
            }
        }
        Ok(lengths)
    }
}

/// Forecasts every column after the observed rows of each trajectory: mean, median and prediction bands.
///
/// # Errors
/// A trajectory that is not longer than the prefix, or a model that cannot be simulated.
pub fn bands(
    model: &dyn PrefixForecaster,
    data: &TimedSequences,
    (sensor, start): (&Sensor, &InitialStatePrior),
    seen: PrefixLength,
    settings: FilterSettings,
) -> anyhow::Result<Dataset> {
    let (set, columns) = (&data.set, data.set.columns.len());
    let longest = set.items.iter().map(|q| q.time).max().unwrap_or(0);
    check_size(1, settings.samples, longest, columns)?;
    let lengths = data.lengths(&[seen])?;
    let rows = (set.items.par_iter().zip(&data.times).zip(&lengths).enumerate()).map(
        |(index, ((q, times), lengths))| {
            let n = lengths[0];
            if n >= q.time {
                let fault = PrefixFault::AllOf { seen, trajectory: q.id.clone(), samples: q.time };
                return Err(Usage::Prefix(fault).into());
            }
            let observed = |(i, v): (usize, &f64)| match sensor.sd()[i % columns] {
                Some(_) => *v,
                None => f64::NAN,
            };
            let rows: Vec<f64> = q.states[..n * columns].iter().enumerate().map(observed).collect();
            let prefix = Prefix {
                id: &q.id,
                rows: &rows,
                sensor,
                start,
                actions: &q.actions,
                time: q.time,
                index: index as u64,
            };
            let samples = only_forecast(model.forecasts(prefix, &[n], settings)?)?;
            anyhow::Ok((q.id.clone(), times[n..].to_vec(), samples))
        },
    );
    summarised(&set.columns, collect_in_order(rows)?)
}

/// Takes the forecast out of a list that has one for the only prefix.
fn only_forecast(mut forecasts: Vec<Samples>) -> Result<Samples, TrainerError> {
    forecasts.pop().ok_or(TrainerError::NoTrajectories { what: "the forecast" })
}
