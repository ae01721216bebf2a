//! The trait [`PrefixForecaster`]: forecasts of a trajectory after its first rows were observed.

use super::initial_state_latents::WithInitialState;
use super::{
    EngineTransition, Filter, FittedDrop, InitialStatePrior, NetTransition, RandomRestitution, Sensor,
    TransitionModel,
};
use crate::{Forecaster, NetModel, SAMPLES, Samples, Task, TrainerError};
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardNormal};

/// Settings of a filter run: numbers of particles and samples, and kind of the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FilterSettings {
    /// Number of particles of the filter.
    pub particles: usize,
    /// Number of sampled trajectories per forecast.
    pub samples: usize,
    /// Seed of the simulated measurement noise and of the particles.
    pub seed: u64,
    /// Whether the rows are sensor readings instead of true states.
    /// If so, no noise is added to the observed rows, and measurement noise is added to the forecasts.
    pub is_measured: bool,
}

impl FilterSettings {
    /// Creates settings with [`SAMPLES`] samples per forecast, for rows that hold true states.
    pub fn new(particles: usize, seed: u64) -> Self {
        FilterSettings { particles, samples: SAMPLES, seed, is_measured: false }
    }
}

/// Everything that a model may use for a forecast: observed rows, sensor, prior, and actions.
#[derive(Debug, Clone, Copy)]
pub struct Prefix<'a> {
    /// Identifier of the observed trajectory.
    pub id: &'a str,
    /// Rows `[n, S]` (n samples of S state columns) observed so far.
    pub rows: &'a [f64],
    /// Sensor through which the rows were observed.
    pub sensor: &'a Sensor,
    /// Prior distribution of the initial state.
    pub start: &'a InitialStatePrior,
    /// Actions `[T, A]` (T samples, A columns) of the whole trajectory, known in advance.
    pub actions: &'a [f64],
    /// Number T of rows of the whole trajectory.
    pub time: usize,
    /// Index of the trajectory in its set; selects the random stream.
    pub index: u64,
}

impl<'a> Prefix<'a> {
    /// Returns the task of forecasting from the first row alone.
    pub(super) fn task(&self) -> Task<'a> {
        let s = self.sensor.sd().len();
        Task { start: &self.rows[..s], actions: self.actions, time: self.time, index: self.index }
    }

    /// Checks that all values of the given rows `[n, S]` are finite.
    ///
    /// # Errors
    /// [`TrainerError::MissingMeasurement`] with the row and column of the first missing value.
    pub(super) fn check_measured(&self, rows: &[f64]) -> Result<(), TrainerError> {
        let s = self.sensor.sd().len();
        let missing = rows.iter().position(|v| !v.is_finite());
        missing.map_or(Ok(()), |i| Err(TrainerError::MissingMeasurement { row: i / s, column: i % s }))
    }
}

/// A model that forecasts after an observed prefix (the first rows of a trajectory).
/// It has access to its [`Prefix`] and to no later row.
pub trait PrefixForecaster: Sync {
    /// Forecasts `[time - n, S, sample]` after the first n rows, for every n of `lengths`.
    /// The lengths are ascending and at most the prefix's. A forecast after n rows is made before row n is
    /// read.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run, or the rows do not determine the unknowns.
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError>;
}

impl PrefixForecaster for NetModel {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let from_initial_state = |samples: usize| -> Result<Samples, TrainerError> {
            // One exact row carries no information about the latents, so the forecast from the first state
            // is reused. It is then identical in every bit to the forecast without a filter.
            let mut forecast = self.forecast(prefix.task(), samples)?;
            forecast.values.drain(..prefix.sensor.sd().len() * forecast.count);
            Ok(forecast)
        };
        forecast_with_filter(
            &|| Ok(Box::new(NetTransition::new(self)?)),
            Some(&from_initial_state),
            prefix,
            lengths,
            settings,
        )
    }
}

impl PrefixForecaster for RandomRestitution {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let new_model = || -> Result<Box<dyn TransitionModel>, TrainerError> {
            Ok(if prefix.sensor.is_exact() {
                Box::new(*self)
            } else {
                Box::new(WithInitialState::new(*self))
            })
        };
        forecast_with_filter(&new_model, None, prefix, lengths, settings)
    }
}

impl PrefixForecaster for EngineTransition<'_> {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        forecast_with_filter(&|| Ok(Box::new(self.clone())), None, prefix, lengths, settings)
    }
}

impl PrefixForecaster for FittedDrop {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        _: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let s = prefix.sensor.sd().len();
        let fit = |&n: &usize| {
            let path = self.path(&prefix.rows[..n * s], prefix.sensor, prefix.time);
            Samples { count: 1, values: path[n * s..].iter().map(|v| *v as f32).collect() }
        };
        Ok(lengths.iter().map(fit).collect())
    }
}

/// Runs a particle filter over the prefix and forecasts after each of `lengths` rows.
/// `unfiltered` makes the forecast after one exact row, for models that need no filter there.
fn forecast_with_filter<'m>(
    new_model: &dyn Fn() -> Result<Box<dyn TransitionModel + 'm>, TrainerError>,
    unfiltered: Option<&dyn Fn(usize) -> Result<Samples, TrainerError>>,
    prefix: Prefix<'_>,
    lengths: &[usize],
    settings: FilterSettings,
) -> Result<Vec<Samples>, TrainerError> {
    let s = prefix.sensor.sd().len();
    let action_width = prefix.actions.len() / prefix.time;
    let sensor_and_start = (prefix.sensor.clone(), prefix.start.clone());
    let stream = (settings.seed, prefix.index);
    let actions = prefix.actions;
    let mut filter =
        Filter::new(new_model()?, sensor_and_start, (actions, action_width), settings.particles, stream);
    let mut out = Vec::with_capacity(lengths.len());
    for &n in lengths {
        while filter.observed_rows() < n {
            filter.observe(&prefix.rows[filter.observed_rows() * s..][..s])?;
        }
        let mut samples = match unfiltered.filter(|_| n == 1 && prefix.sensor.is_exact()) {
            Some(unfiltered) => unfiltered(settings.samples)?,
            None => filter.forecast(prefix.time - n, settings.samples)?.clone(),
        };
        if settings.is_measured {
            add_measurement_noise(&mut samples, prefix.sensor.sd(), (settings.seed, prefix.index, n));
        }
        out.push(samples);
    }
    Ok(out)
}

/// Adds simulated measurement noise to samples `[horizon, S, sample]` of states, column by column.
pub(super) fn add_measurement_noise(
    samples: &mut Samples,
    sd: &[Option<f64>],
    (seed, index, n): (u64, u64, usize),
) {
    let mut rng = random_stream(seed ^ n as u64, "readings", index);
    for (row, values) in samples.values.chunks_exact_mut(samples.count).enumerate() {
        let Some(sd) = sd[row % sd.len()].filter(|sd| *sd > 0.0) else { continue };
        for v in values {
            let draw: f64 = StandardNormal.sample(&mut rng);
            *v += (sd * draw) as f32;
        }
    }
}
