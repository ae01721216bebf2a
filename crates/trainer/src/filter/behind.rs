//! One trait for every model that forecasts behind a prefix.

use super::started::Started;
use super::{EngineLaw, Filter, FittedDrop, NetLaw, RestitutionLaw, Sensor, StartLaw, StepLaw};
use crate::{Forecaster, NetModel, SAMPLES, Samples, Task, TrainerError};
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardNormal};

/// How a filter runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FilterSettings {
    /// Particles.
    pub particles: usize,
    /// Draws of a forecast.
    pub samples: usize,
    /// Seed of the sensor's noise and of the particles.
    pub seed: u64,
    /// Whether the rows are readings of the sensor and not the truth: then nothing is added to what is seen, and the sensor's
    /// noise is added to what is forecast.
    pub is_measured: bool,
}

impl FilterSettings {
    /// The usual number of draws, of rows that are the truth.
    pub fn new(particles: usize, seed: u64) -> Self {
        FilterSettings { particles, samples: SAMPLES, seed, is_measured: false }
    }
}

/// Knowledge that a model forecasts from: the rows seen, through which sensor, and the law of the start.
#[derive(Debug, Clone, Copy)]
pub struct Prefix<'a> {
    /// Name of the trajectory.
    pub id: &'a str,
    /// Rows `[n, S]` as measured.
    pub rows: &'a [f64],
    /// The sensor.
    pub sensor: &'a Sensor,
    /// Law of first states.
    pub start: &'a StartLaw,
    /// Actions `[T, A]`, known beforehand.
    pub actions: &'a [f64],
    /// Rows of the whole trajectory.
    pub time: usize,
    /// Place of the trajectory in its set.
    pub index: u64,
}

impl<'a> Prefix<'a> {
    /// The forecast from the first row alone.
    pub(super) fn task(&self) -> Task<'a> {
        let s = self.sensor.sd().len();
        Task { start: &self.rows[..s], actions: self.actions, time: self.time, index: self.index }
    }

    /// Checks that every value of some of its rows `[n, S]` was seen.
    pub(super) fn check_seen(&self, rows: &[f64]) -> Result<(), TrainerError> {
        let s = self.sensor.sd().len();
        let hole = rows.iter().position(|v| !v.is_finite());
        hole.map_or(Ok(()), |i| Err(TrainerError::Unseen { row: i / s, column: i % s }))
    }
}

/// A model that forecasts behind a prefix. It never sees more than its [`Prefix`].
pub trait PrefixForecaster: Sync {
    /// Forecasts `[time - n, S, sample]` behind the first n rows, for every n of `lengths` (ascending, at most the prefix's).
    /// A forecast behind n rows is made before row n is read.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run, or the rows say too little.
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
        let first = |samples: usize| -> Result<Samples, TrainerError> {
            // Behind one exact row nothing is filtered: the forecast from the first state, to the byte.
            let mut whole = self.forecast(prefix.task(), samples)?;
            whole.values.drain(..prefix.sensor.sd().len() * whole.count);
            Ok(whole)
        };
        stepped(&|| Ok(Box::new(NetLaw::new(self)?)), Some(&first), prefix, lengths, settings)
    }
}

impl PrefixForecaster for RestitutionLaw {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let law = || -> Result<Box<dyn StepLaw>, TrainerError> {
            Ok(if prefix.sensor.is_exact() { Box::new(*self) } else { Box::new(Started::new(*self)) })
        };
        stepped(&law, None, prefix, lengths, settings)
    }
}

impl PrefixForecaster for EngineLaw<'_> {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        stepped(&|| Ok(Box::new(self.clone())), None, prefix, lengths, settings)
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

/// Forecasts of a law of steps; `first` is the forecast behind one exact row, where it is made without a filter.
fn stepped<'m>(
    law: &dyn Fn() -> Result<Box<dyn StepLaw + 'm>, TrainerError>,
    first: Option<&dyn Fn(usize) -> Result<Samples, TrainerError>>,
    prefix: Prefix<'_>,
    lengths: &[usize],
    settings: FilterSettings,
) -> Result<Vec<Samples>, TrainerError> {
    let s = prefix.sensor.sd().len();
    let width = prefix.actions.len() / prefix.time;
    let known = (prefix.sensor.clone(), prefix.start.clone());
    let stream = (settings.seed, prefix.index);
    let actions = prefix.actions;
    let mut filter = Filter::new(law()?, known, (actions, width), settings.particles, stream);
    let mut out = Vec::with_capacity(lengths.len());
    for &n in lengths {
        while filter.seen() < n {
            filter.observe(&prefix.rows[filter.seen() * s..][..s])?;
        }
        let mut samples = match first.filter(|_| n == 1 && prefix.sensor.is_exact()) {
            Some(first) => first(settings.samples)?,
            None => filter.forecast(prefix.time - n, settings.samples)?.clone(),
        };
        if settings.is_measured {
            read_by_sensor(&mut samples, prefix.sensor.sd(), (settings.seed, prefix.index, n));
        }
        out.push(samples);
    }
    Ok(out)
}

/// Adds the sensor's noise of each column to samples `[rest, S, sample]` of states.
pub(super) fn read_by_sensor(samples: &mut Samples, sd: &[Option<f64>], (seed, index, n): (u64, u64, usize)) {
    let mut rng = random_stream(seed ^ n as u64, "readings", index);
    for (row, values) in samples.values.chunks_exact_mut(samples.count).enumerate() {
        let Some(sd) = sd[row % sd.len()].filter(|sd| *sd > 0.0) else { continue };
        for v in values {
            let draw: f64 = StandardNormal.sample(&mut rng);
            *v += (sd * draw) as f32;
        }
    }
}
