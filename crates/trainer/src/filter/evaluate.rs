//! The protocol `filtered`: every model sees the same noisy rows and forecasts the rest.

use super::least_squares::FittedDrop;
use super::score::{FilteredScore, tally};
use super::{Filter, NetLaw, RestitutionLaw, Sensor, StartLaw};
use crate::score::Scoring;
use crate::{Forecaster, NetModel, SAMPLES, Samples, Sequence, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// How a filter runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FilterSettings {
    /// Particles.
    pub particles: usize,
    /// Seed of the sensor's noise and of the particles.
    pub seed: u64,
}

/// What a model is told: the rows seen, through which sensor, and what is known of the start.
#[derive(Debug, Clone, Copy)]
pub struct Prefix<'a> {
    /// Rows `[n, S]` as measured.
    pub rows: &'a [f64],
    /// The sensor.
    pub sensor: &'a Sensor,
    /// What is known of first states.
    pub start: &'a StartLaw,
    /// Actions `[T, A]`, known beforehand.
    pub actions: &'a [f64],
    /// Rows of the whole trajectory.
    pub time: usize,
    /// Place of the trajectory in its set.
    pub index: u64,
}

/// A model that forecasts behind a prefix.
#[derive(Debug, Clone, Copy)]
pub enum FilteredModel<'m> {
    /// Hybrid+.
    Net(&'m NetModel),
    /// PyBullet's ball whose restitution differs from drop to drop.
    Restitution(RestitutionLaw),
    /// Least squares on the prefix.
    LeastSquares(FittedDrop),
}

impl FilteredModel<'_> {
    /// Forecasts `[time - n, S, sample]` behind the first n rows, for every n of `lengths` (ascending, at most the prefix's).
    /// A forecast behind n rows is made before row n is read.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run.
    pub fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let s = prefix.sensor.sd().len();
        let law: Box<dyn super::StepLaw> = match self {
            FilteredModel::LeastSquares(drop) => {
                let fit = |&n: &usize| {
                    let path = drop.path(&prefix.rows[..n * s], prefix.sensor, prefix.time);
                    Samples { count: 1, values: path[n * s..].iter().map(|v| *v as f32).collect() }
                };
                return Ok(lengths.iter().map(fit).collect());
            }
            FilteredModel::Net(model) => Box::new(NetLaw::new(model)?),
            FilteredModel::Restitution(law) => Box::new(*law),
        };
        let width = prefix.actions.len() / prefix.time;
        let known = (prefix.sensor.clone(), prefix.start.clone());
        let stream = (settings.seed, prefix.index);
        let mut filter = Filter::new(law, known, (prefix.actions, width), settings.particles, stream);
        let mut out = Vec::with_capacity(lengths.len());
        for &n in lengths {
            while filter.seen() < n {
                filter.observe(&prefix.rows[filter.seen() * s..][..s])?;
            }
            out.push(match self {
                // Behind one exact row nothing is filtered: the forecast from the first state, to the byte.
                FilteredModel::Net(model) if n == 1 && prefix.sensor.is_exact() => {
                    let Prefix { rows, actions, time, index, .. } = prefix;
                    let task = Task { start: &rows[..s], actions, time, index };
                    let mut whole = model.forecast(task, SAMPLES)?;
                    whole.values.drain(..s * whole.count);
                    whole
                }
                _ => filter.forecast(prefix.time - n, SAMPLES)?,
            });
        }
        Ok(out)
    }
}

/// Scores a model behind prefixes of the given lengths (ascending); trajectories that are not longer than a prefix do not
/// count for it. The truth is `test`, what is seen is `test` with the sensor's noise.
///
/// # Errors
/// [`TrainerError`] if the model cannot be run, or there is nothing to score.
pub fn evaluate_filtered(
    model: FilteredModel<'_>,
    test: &Sequences,
    (sensor, start): (&Sensor, &StartLaw),
    lengths: &[usize],
    settings: FilterSettings,
) -> Result<Vec<FilteredScore>, TrainerError> {
    let scoring = Scoring::of(test);
    let scores = (test.items.par_iter().enumerate())
        .map(|(index, q)| {
            let fitting: Vec<usize> = lengths.iter().copied().filter(|n| *n < q.time).collect();
            let rows = measured(q, sensor, settings.seed, index as u64);
            let prefix = Prefix {
                rows: &rows[..fitting.last().copied().unwrap_or(0) * sensor.sd().len()],
                sensor,
                start,
                actions: &q.actions,
                time: q.time,
                index: index as u64,
            };
            let forecasts = model.forecasts(prefix, &fitting, settings)?;
            let tallies = forecasts.iter().zip(&fitting);
            Ok(tallies.map(|(samples, &n)| tally(samples, &q.states, n, &scoring)).collect())
        })
        .collect::<Result<Vec<Vec<_>>, TrainerError>>()?;
    (0..lengths.len())
        .map(|k| {
            let of: Vec<_> = scores.iter().filter_map(|each| each.get(k).cloned()).collect();
            match of.is_empty() {
                true => Err(TrainerError::NoTrajectories { what: "the test set, behind the prefix," }),
                false => Ok(FilteredScore::of(&of)),
            }
        })
        .collect()
}

/// The rows `[T, S]` of a trajectory as the sensor measures them: one stream of noise for each trajectory and seed.
fn measured(q: &Sequence, sensor: &Sensor, seed: u64, index: u64) -> Vec<f64> {
    let mut rng = random_stream(seed, "sensor", index);
    let mut rows = q.states.clone();
    for row in rows.chunks_exact_mut(sensor.sd().len()) {
        for (value, sd) in row.iter_mut().zip(sensor.sd()) {
            let draw: f64 = StandardNormal.sample(&mut rng);
            *value = match sd {
                Some(sd) => *value + sd * draw,
                // What is not seen is not handed over.
                None => f64::NAN,
            };
        }
    }
    rows
}
