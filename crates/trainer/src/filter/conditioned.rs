//! Conditions the samples of any forecaster on an observed prefix, by linear regression.
//!
//! Each sample of the forecaster is a joint draw of the observed rows and of the remaining ones. With
//! principal components s of the observed rows, scores s_k of sample k and s_obs of the measurements,
//!
//! ```text
//! (1)  x_k' = x_k + B (s_obs - s_k),    B = cov(x, s) cov(s)^-1,
//! ```
//!
//! moves the remaining rows x_k of each sample (the analysis step of the ensemble Kalman filter, Evensen
//! 2003; exact for jointly normal samples). The principal components of one set of samples are
//! uncorrelated, so cov(s) is diagonal. A net that was trained on readings draws readings, so its samples
//! already contain the measurement noise and none is added.

use super::prefix::{FilterSettings, Prefix, PrefixForecaster};
use super::trajectory_regression::{MIN_COMPONENT_VARIANCE, components, dot, scores};
use crate::{Forecaster, Samples, TrainerError};

/// Minimum number of forecast samples for the regression.
const MIN_SAMPLES: usize = 500;
/// Maximum number of principal components of the observed rows.
/// It exceeds the number of unknowns of a trajectory and is small enough for the number of samples.
const MAX_COMPONENTS: usize = 8;
/// Unit of deviations in a column that is measured exactly, in the column's unit.
const EXACT_SCALE: f64 = 1e-6;

/// A forecaster from the first row, whose samples are conditioned on all rows observed so far.
#[derive(Clone, Copy)]
pub struct ConditionedForecaster<'m> {
    model: &'m dyn Forecaster,
    /// Maximum number of principal components of the observed rows; 0 ignores all rows after the first.
    max_components: usize,
}

impl std::fmt::Debug for ConditionedForecaster<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Conditioned").field("model", &self.model.name()).finish()
    }
}

impl<'m> ConditionedForecaster<'m> {
    /// Creates a forecaster that conditions the samples of `model` on the observed rows.
    pub fn new(model: &'m dyn Forecaster) -> Self {
        ConditionedForecaster { model, max_components: MAX_COMPONENTS }
    }

    /// Creates the baseline: forecasts of `model` that ignore all observed rows after the first.
    pub fn unconditioned(model: &'m dyn Forecaster) -> Self {
        ConditionedForecaster { model, max_components: 0 }
    }
}

impl PrefixForecaster for ConditionedForecaster<'_> {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let Prefix { rows, sensor, .. } = prefix;
        let scales: Vec<f64> =
            sensor.sd().iter().map(|sd| sd.filter(|sd| *sd > 0.0).unwrap_or(EXACT_SCALE)).collect();
        let s = scales.len();
        prefix.check_measured(rows)?;
        let drawn = self.model.forecast(prefix.task(), MIN_SAMPLES.max(settings.samples))?;
        let deviations = SampleDeviations::new(&drawn, &scales);
        Ok(lengths
            .iter()
            .map(|&n| deviations.condition_on_prefix(&rows[..n * s], self.max_components, settings.samples))
            .collect())
    }
}

/// Deviations of the samples from their mean, in units of the measurement noise.
struct SampleDeviations<'a> {
    scales: &'a [f64],
    /// Mean of the samples, `[T S]` (S columns at T times), in the columns' units.
    mean: Vec<f64>,
    /// Deviations of the samples from the mean, `[sample][T S]`, in units of the measurement noise.
    deviations: Vec<Vec<f64>>,
}

impl<'a> SampleDeviations<'a> {
    fn new(drawn: &Samples, scales: &'a [f64]) -> Self {
        let (s, count) = (scales.len(), drawn.count);
        let mean: Vec<f64> = (drawn.values.chunks_exact(count))
            .map(|row| row.iter().map(|v| f64::from(*v)).sum::<f64>() / count as f64)
            .collect();
        let value = |i: usize, k: usize| (f64::from(drawn.values[i * count + k]) - mean[i]) / scales[i % s];
        let deviations = (0..count).map(|k| (0..mean.len()).map(|i| value(i, k)).collect()).collect();
        SampleDeviations { scales, mean, deviations }
    }

    /// Returns `samples` draws of the rows after `readings [n, S]`, conditioned on these by formula (1).
    /// `max_components` is the maximum number of principal components.
    fn condition_on_prefix(&self, readings: &[f64], max_components: usize, samples: usize) -> Samples {
        let (s, observed_values, sample_count) =
            (self.scales.len(), readings.len(), self.deviations.len() as f64);
        let observed: Vec<&[f64]> = self.deviations.iter().map(|path| &path[..observed_values]).collect();
        let (directions, variances) =
            components(&observed, max_components, MIN_COMPONENT_VARIANCE).unwrap_or_default();
        let sample_scores: Vec<Vec<f64>> = observed.iter().map(|path| scores(&directions, path)).collect();
        let standardised: Vec<f64> =
            readings.iter().enumerate().map(|(i, v)| (v - self.mean[i]) / self.scales[i % s]).collect();
        let observed_scores = scores(&directions, &standardised);
        let rows_ahead = self.mean.len() - observed_values;
        let mut values = vec![0.0_f32; rows_ahead * samples];
        for (i, row) in values.chunks_exact_mut(samples).enumerate() {
            let index = observed_values + i;
            // Principal components of the same samples are uncorrelated, so each slope is fitted alone.
            let slopes: Vec<f64> = (variances.iter().enumerate())
                .map(|(c, variance)| {
                    let products = self
                        .deviations
                        .iter()
                        .zip(&sample_scores)
                        .map(|(path, sample_scores)| path[index] * sample_scores[c]);
                    products.sum::<f64>() / (sample_count * variance)
                })
                .collect();
            for (k, slot) in row.iter_mut().enumerate() {
                let score_changes: Vec<f64> = observed_scores
                    .iter()
                    .zip(&sample_scores[k])
                    .map(|(observed_scores, score)| observed_scores - score)
                    .collect();
                let deviations = self.deviations[k][index] + dot(&slopes, &score_changes);
                *slot = (self.mean[index] + self.scales[index % s] * deviations) as f32;
            }
        }
        Samples { count: samples, values }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: conditioned forecasts of lines with a random slope match the closed-form posterior.
    use super::*;
    use crate::filter::{InitialStatePrior, Sensor};
    use crate::{Sequence, Sequences, Task};
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    const NOISE: f64 = 0.1;

    /// Test model: straight lines from 0 with one random slope, and noise on each row but the first.
    struct Lines;

    impl Forecaster for Lines {
        fn name(&self) -> &str {
            "lines"
        }

        fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
            let mut rng = random_stream(4, "lines", task.index);
            let mut values = vec![0.0; task.time * samples];
            for k in 0..samples {
                let slope: f64 = StandardNormal.sample(&mut rng);
                for t in 1..task.time {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    values[t * samples + k] = (slope * t as f64 + NOISE * noise) as f32;
                }
            }
            Ok(Samples { count: samples, values })
        }
    }

    #[test]
    fn conditioned_samples_follow_the_closed_form_posterior() {
        let (time, n) = (12, 6);
        let rows: Vec<f64> = (0..n).map(|t| 0.7 * t as f64 + if t % 2 == 1 { 0.05 } else { -0.03 }).collect();
        let sensor = Sensor::new(vec![Some(NOISE)]).expect("a sensor");
        let item = Sequence { id: "a".into(), time, states: vec![0.0; time], actions: Vec::new() };
        let columns = ["height_m".to_owned()].into();
        let start = InitialStatePrior::from_training_set(&Sequences {
            columns,
            action_columns: Vec::new(),
            items: vec![item.clone(), item],
        });
        let prefix =
            Prefix { id: "a", rows: &rows, sensor: &sensor, start: &start, actions: &[], time, index: 0 };
        let forecast = ConditionedForecaster::new(&Lines).forecasts(prefix, &[n], FilterSettings::new(1, 1));
        let samples = forecast.expect("a forecast").remove(0);
        // The prior has precision 1, and row t adds t²/NOISE². The first row is exact and carries no
        // information.
        let precision: f64 = 1.0 + (1..n).map(|t| (t * t) as f64 / (NOISE * NOISE)).sum::<f64>();
        let slope = (1..n).map(|t| t as f64 * rows[t] / (NOISE * NOISE)).sum::<f64>() / precision;
        let last = &samples.values[(time - 1 - n) * samples.count..];
        let mean = last.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.count as f64;
        let variance =
            last.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / samples.count as f64;
        let horizon = (time - 1) as f64;
        let expected_variance = NOISE * NOISE + horizon * horizon / precision;
        // The bounds are those of 100 samples: four standard errors of the mean, a factor of two in the
        // variance.
        assert!(
            (mean - horizon * slope).abs() < 0.4 * expected_variance.sqrt(),
            "{mean} against {}",
            horizon * slope
        );
        assert!(
            (0.5..2.0).contains(&(variance / expected_variance)),
            "{variance} against {expected_variance}"
        );
        let unconditioned =
            ConditionedForecaster::unconditioned(&Lines).forecasts(prefix, &[n], FilterSettings::new(1, 1));
        let task = Task { start: &rows[..1], actions: &[], time, index: 0 };
        let drawn = Lines.forecast(task, 500).expect("draws");
        let (unconditioned, index) = (unconditioned.expect("a forecast").remove(0), n * 500);
        assert!(
            (unconditioned.values[0] - drawn.values[index]).abs() < 1e-5,
            "the draws themselves, without conditioning"
        );
    }
}
