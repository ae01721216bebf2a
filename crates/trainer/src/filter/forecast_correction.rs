//! A recurrent net that corrects another model's forecasts, as the paper's Hybrid corrects roll-outs.
//!
//! The method follows Ajay et al. 2018, section IV; here the roll-out starts after the observed rows. The
//! net reads the forecast row by row. Its inputs are the median of each column, the change of the median
//! since the row before and the spread of the samples, the number of observed rows, and the forecast
//! horizon. Its outputs are the location and the scale of (truth - median) / u. The corrected median
//! of column j is
//!
//! ```text
//! (1)  m' = m + a u c,    u = sd + 0.1 sd_typical(j),
//! ```
//!
//! with median m and standard deviation sd of the samples, predicted location c and shrinkage factor a; the
//! samples are rescaled about it to the predicted scale. The trajectories are split into five folds. One
//! net is trained without each fold, and a is chosen by the error on the folds that the nets have not seen.
//! A new forecast is corrected by the mean of the five nets.

use super::evaluate::map_forecasts;
use super::forecast_net::ForecastNet;
use super::prefix::{FilterSettings, Prefix, PrefixForecaster};
use super::{InitialStatePrior, Sensor};
use crate::league::Extents;
use crate::prepared::Prepared;
use crate::scales::positive;
use crate::score::median_of;
use crate::tiles::{TileContext, Workspace, clip, sum_gradients};
use crate::{Samples, Sequence, Sequences, TrainerError, collect_in_order};
use augsim_data::random_stream;
use augsim_nn::{Adam, AdamState, Params, StepDecay};
use augsim_system::statistics::median;
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// Number of cross-validation folds.
const FOLDS: usize = 5;
/// Number of training iterations of each net.
const ITERATIONS: u64 = 400;
/// Number of forecasts in a training batch.
const BATCH: usize = 32;
/// Maximum norm of a gradient; larger gradients are scaled down to it.
const CLIP: f64 = 10.0;
/// Learning rate: initial 3e-3, halved after every eighth of the iterations.
const LEARNING_RATE: StepDecay = StepDecay { initial: 3e-3, factor: 0.5, every: ITERATIONS / 8 };
/// Candidate shrinkage factors of the correction; 0 keeps the median of the uncorrected forecast.
const SHRINKAGE_FACTORS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Share of the column's typical spread that is added to the samples' spread in the unit of corrections.
/// Samples that agree can all be wrong, so their spread alone would give a unit of zero.
const TYPICAL_SPREAD_SHARE: f64 = 0.1;
/// Bound of the standardised features: the net was not trained on values beyond it.
const FEATURE_BOUND: f64 = 6.0;
/// Number of features per state column, and number of additional features per row.
const FEATURES_PER_COLUMN: usize = 3;
const FEATURES_PER_ROW: usize = 2;

/// A learned correction of a model's forecasts: nets, scales and shrinkage factor.
#[derive(Debug, Clone)]
pub struct ForecastCorrection {
    net: ForecastNet,
    /// Parameters of the nets, one per cross-validation fold; each was trained without its fold.
    params: Vec<Params<f32>>,
    scales: Scales,
    shrinkage: f64,
}

/// Normalisation scales of features and corrections.
#[derive(Debug, Clone, Default)]
struct Scales {
    /// Mean and standard deviation over all rows of the forecast medians, per column.
    mean: Vec<f64>,
    sd: Vec<f64>,
    /// Root mean square change of the forecast median from row to row, per column.
    row_change: Vec<f64>,
    /// Median over all rows of the samples' standard deviation, per column.
    spread: Vec<f64>,
    /// Mean number of forecast rows, and mean number of observed rows, over the training forecasts.
    mean_rows: [f64; 2],
}

/// Median and standard deviation `[horizon, S]` of a forecast's samples, after `observed_rows` rows.
struct Summary {
    observed_rows: usize,
    median: Vec<f64>,
    spread: Vec<f64>,
}

impl Summary {
    fn new(samples: &Samples, observed_rows: usize) -> Self {
        let mut sorted = vec![0.0; samples.count];
        let (mut median, mut spread) = (Vec::new(), Vec::new());
        for values in samples.values.chunks_exact(samples.count) {
            median.push(median_of(values, &mut sorted));
            let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.count as f64;
            let square = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>();
            spread.push((square / samples.count as f64).sqrt());
        }
        Summary { observed_rows, median, spread }
    }
}

impl Scales {
    fn fit(forecasts: &[(usize, Summary)], s: usize) -> Self {
        let mut scales = Scales::default();
        let rows: usize = forecasts.iter().map(|(_, summary)| summary.median.len() / s).sum();
        let count = rows.max(1) as f64;
        for j in 0..s {
            let medians =
                || forecasts.iter().flat_map(|(_, summary)| summary.median.iter().skip(j).step_by(s));
            let mean = medians().sum::<f64>() / count;
            let sum_of_squares = medians().map(|v| (v - mean).powi(2)).sum::<f64>();
            let row_changes =
                forecasts.iter().flat_map(|(_, summary)| summary.median.windows(s + 1).skip(j).step_by(s));
            let row_change = row_changes.map(|w| (w[s] - w[0]).powi(2)).sum::<f64>();
            let mut spreads: Vec<f64> = forecasts
                .iter()
                .flat_map(|(_, summary)| summary.spread.iter().skip(j).step_by(s).copied())
                .collect();
            scales.mean.push(mean);
            scales.sd.push(positive((sum_of_squares / count).sqrt(), 0.0));
            scales.row_change.push(positive((row_change / count).sqrt(), 0.0));
            scales.spread.push(positive(if spreads.is_empty() { 0.0 } else { median(&mut spreads) }, 0.0));
        }
        let observed_rows: usize = forecasts.iter().map(|(_, summary)| summary.observed_rows).sum();
        let forecast_count = forecasts.len().max(1) as f64;
        scales.mean_rows = [rows, observed_rows].map(|count| positive(count as f64 / forecast_count, 0.0));
        scales
    }

    /// Unit of the correction of state column `j` where the samples have standard deviation `spread`.
    fn unit(&self, j: usize, spread: f64) -> f64 {
        spread + TYPICAL_SPREAD_SHARE * self.spread[j]
    }

    /// Computes the net's features `[horizon, U]` of a forecast, U features per row.
    fn features(&self, summary: &Summary) -> Vec<f32> {
        let s = self.mean.len();
        let mut features =
            Vec::with_capacity(summary.median.len() / s * (FEATURES_PER_COLUMN * s + FEATURES_PER_ROW));
        let bounded = |v: f64| v.clamp(-FEATURE_BOUND, FEATURE_BOUND) as f32;
        let rows_ahead = summary.median.len() / s;
        for t in 0..rows_ahead {
            // The change to the first forecast row would need the last observed row, so that of the second
            // is used.
            let (from, to) = if t == 0 { (0, (rows_ahead - 1).min(1)) } else { (t - 1, t) };
            for j in 0..s {
                let unit = self.unit(j, summary.spread[t * s + j]);
                features.push(bounded((summary.median[t * s + j] - self.mean[j]) / self.sd[j]));
                features.push(bounded(
                    (summary.median[to * s + j] - summary.median[from * s + j]) / self.row_change[j],
                ));
                features.push(bounded((unit / self.spread[j]).ln()));
            }
            features.push(bounded((t + 1) as f64 / self.mean_rows[0]));
            features.push(bounded(summary.observed_rows as f64 / self.mean_rows[1]));
        }
        features
    }

    /// Computes features and targets of a forecast, up to the first row with a missing measurement.
    fn prepare(&self, summary: &Summary, q: &Sequence) -> Prepared {
        let s = self.mean.len();
        let truth = &q.states[summary.observed_rows * s..];
        let time = truth.chunks_exact(s).take_while(|row| row.iter().all(|v| v.is_finite())).count();
        let mut u = self.features(summary);
        u.truncate(time * (FEATURES_PER_COLUMN * s + FEATURES_PER_ROW));
        let x = (0..time * s)
            .map(|i| ((truth[i] - summary.median[i]) / self.unit(i % s, summary.spread[i])) as f32);
        Prepared { time, x_width: s, u_width: FEATURES_PER_COLUMN * s + FEATURES_PER_ROW, x: x.collect(), u }
    }
}

impl ForecastCorrection {
    /// Trains the nets on the forecasts of `model` for the trajectories `train`.
    /// `lengths [trajectory][prefix]` are the ascending numbers of observed rows. The model itself may have
    /// been fitted to the same trajectories if it has few parameters for all of them.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run, there are fewer trajectories than folds, or training
    /// diverges.
    pub fn learn(
        model: &dyn PrefixForecaster,
        train: &Sequences,
        known: (&Sensor, &InitialStatePrior),
        lengths: &[Vec<usize>],
        settings: FilterSettings,
    ) -> Result<Self, TrainerError> {
        if train.items.len() < FOLDS {
            return Err(TrainerError::NoTrajectories { what: "one of the five cross-validation folds" });
        }
        let s = train.state_dim();
        let summarise = |index: usize, n: usize, samples: Samples| (index, Summary::new(&samples, n));
        let forecasts = map_forecasts(model, train, known, (lengths, settings), &summarise)?;
        let forecasts: Vec<(usize, Summary)> = forecasts.into_iter().flatten().collect();
        let scales = Scales::fit(&forecasts, s);
        let prepared: Vec<(usize, Prepared)> = forecasts
            .iter()
            .map(|(index, summary)| (*index, scales.prepare(summary, &train.items[*index])))
            .filter(|(_, example)| example.time > 0)
            .collect();
        let extents = Extents { state: s, condition: FEATURES_PER_COLUMN * s + FEATURES_PER_ROW };
        let folds = (0..FOLDS).into_par_iter().map(|fold| {
            let mut params = Params::new(random_stream(settings.seed, "correction", fold as u64));
            let net = ForecastNet::new(extents, &mut params);
            let others = prepared.iter().filter(|(index, _)| index % FOLDS != fold);
            train_net(
                &net,
                &mut params,
                &others.map(|(_, example)| example.clone()).collect::<Vec<_>>(),
                settings.seed,
            )?;
            Ok::<_, TrainerError>((net, params))
        });
        let (mut nets, params): (Vec<ForecastNet>, Vec<Params<f32>>) =
            collect_in_order(folds)?.into_iter().unzip();
        let mut correction = ForecastCorrection { net: nets.swap_remove(0), params, scales, shrinkage: 0.0 };
        correction.shrinkage = correction.choose_shrinkage(&prepared);
        Ok(correction)
    }

    /// Chooses the shrinkage factor with the smallest out-of-fold error of the forecasts.
    /// The error is the mean over forecasts of the logarithm of the mean absolute deviation: with the
    /// logarithm a few trajectories with very large errors do not decide.
    fn choose_shrinkage(&self, prepared: &[(usize, Prepared)]) -> f64 {
        let log_error = |shrinkage: f64| -> f64 {
            let errors = prepared.par_iter().map(|(index, example)| {
                let [location, _] = self.net.predict(&self.params[index % FOLDS], &example.u);
                let deviation = example
                    .x
                    .iter()
                    .zip(&location)
                    .map(|(x, c)| (f64::from(*x) - shrinkage * f64::from(*c)).abs());
                (deviation.sum::<f64>() / example.x.len() as f64).max(f64::MIN_POSITIVE).ln()
            });
            // Collected before summing: the result of a parallel sum would depend on how the work was
            // divided.
            errors.collect::<Vec<f64>>().iter().sum()
        };
        let candidates = SHRINKAGE_FACTORS.map(|shrinkage| (log_error(shrinkage), shrinkage));
        candidates
            .iter()
            .fold(candidates[0], |best, candidate| if candidate.0 < best.0 { *candidate } else { best })
            .1
    }

    /// Shrinkage factor that multiplies the correction; chosen by cross-validation.
    pub fn shrinkage(&self) -> f64 {
        self.shrinkage
    }
}

/// Trains one correction net by Adam on random batches.
fn train_net(
    net: &ForecastNet,
    params: &mut Params<f32>,
    prepared: &[Prepared],
    seed: u64,
) -> Result<(), TrainerError> {
    let adam = Adam { weight_decay: 1e-4, ..Adam::default() };
    let mut state = AdamState::new(params.values().len());
    let mut workspace = Workspace::default();
    let mut grads = vec![0.0; params.values().len()];
    let values: usize = prepared.iter().map(|forecast| forecast.x.len()).sum();
    let mean_values = values as f64 / prepared.len().max(1) as f64;
    let batch = BATCH.min(prepared.len());
    let mut order: Vec<usize> = (0..prepared.len()).collect();
    for iteration in 0..ITERATIONS {
        order.sort_unstable();
        let mut rng = random_stream(seed, "correction-batch", iteration);
        let (chosen, _) = order.partial_shuffle(&mut rng, batch);
        // Trajectories of similar length share a tile, which wastes fewer lanes.
        chosen.sort_unstable_by_key(|&i| (std::cmp::Reverse(prepared[i].time), i));
        let scale = 1.0 / (batch as f64 * mean_values);
        workspace.run_all(
            TileContext { net, params: &*params, train_set: prepared, scale, seed },
            chosen,
            0,
        )?;
        let loss = sum_gradients(&workspace.results, scale, &mut grads).negative_ln_likelihood;
        let norm = clip(&mut grads, Some(CLIP));
        let rate = LEARNING_RATE.at(iteration);
        if !loss.is_finite() || !norm.is_finite() {
            return Err(TrainerError::Diverged { iteration: iteration + 1, loss, rate });
        }
        adam.step(&mut state, params.values_mut(), &grads, rate);
    }
    Ok(())
}

/// Forecasts of another model with the learned correction applied.
#[derive(Clone, Copy)]
pub struct CorrectedForecaster<'a> {
    model: &'a dyn PrefixForecaster,
    correction: &'a ForecastCorrection,
    is_cross_validated: bool,
}

impl<'a> CorrectedForecaster<'a> {
    /// Creates a forecaster that corrects the forecasts of `model` by the mean of all nets.
    pub fn new(model: &'a dyn PrefixForecaster, correction: &'a ForecastCorrection) -> Self {
        CorrectedForecaster { model, correction, is_cross_validated: false }
    }

    /// Creates a forecaster for the training trajectories, each corrected by the net trained without it.
    pub fn out_of_fold(model: &'a dyn PrefixForecaster, correction: &'a ForecastCorrection) -> Self {
        CorrectedForecaster { model, correction, is_cross_validated: true }
    }

    /// Predicts location and scale `[horizon, S]` of the correction of a forecast, in units of [`Scales::unit`].
    fn predict_correction(&self, summary: &Summary, index: u64) -> [Vec<f64>; 2] {
        let ForecastCorrection { net, params, scales, .. } = self.correction;
        let fold = index as usize % FOLDS;
        let selected = if self.is_cross_validated { &params[fold..=fold] } else { &params[..] };
        let u = scales.features(summary);
        let mut result = [vec![0.0; summary.median.len()], vec![0.0; summary.median.len()]];
        for params in selected {
            for (result, prediction) in result.iter_mut().zip(net.predict(params, &u)) {
                result
                    .iter_mut()
                    .zip(prediction)
                    .for_each(|(result, v)| *result += f64::from(v) / selected.len() as f64);
            }
        }
        result
    }
}

impl PrefixForecaster for CorrectedForecaster<'_> {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let ForecastCorrection { scales, shrinkage, .. } = self.correction;
        let mut forecasts = self.model.forecasts(prefix, lengths, settings)?;
        for (samples, &n) in forecasts.iter_mut().zip(lengths) {
            let summary = Summary::new(samples, n);
            let [location, scale] = self.predict_correction(&summary, prefix.index);
            for (i, values) in samples.values.chunks_exact_mut(samples.count).enumerate() {
                let unit = scales.unit(i % scales.mean.len(), summary.spread[i]);
                let corrected_median = summary.median[i] + shrinkage * unit * location[i];
                // All samples of a row are transformed by the same increasing map, so each sample path
                // stays coherent.
                let factor = if summary.spread[i] > 0.0 { unit * scale[i] / summary.spread[i] } else { 1.0 };
                for v in values {
                    *v = (corrected_median + factor * (f64::from(*v) - summary.median[i])) as f32;
                }
            }
        }
        Ok(forecasts)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: systematic errors of a model are learned and generalise; pure noise is left uncorrected.
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    const TIME: usize = 30;
    const NOISE: f64 = 0.05;

    /// Test model that extrapolates the line through the first and the last observed row.
    struct LinearExtrapolation;

    impl PrefixForecaster for LinearExtrapolation {
        fn forecasts(
            &self,
            prefix: Prefix<'_>,
            lengths: &[usize],
            settings: FilterSettings,
        ) -> Result<Vec<Samples>, TrainerError> {
            let forecast_after = |&n: &usize| {
                let slope = (prefix.rows[n - 1] - prefix.rows[0]) / (n - 1) as f64;
                let mut rng = random_stream(settings.seed, "straight", prefix.index);
                let mut values = vec![0.0; (prefix.time - n) * settings.samples];
                for k in 0..settings.samples {
                    let draw: f64 = StandardNormal.sample(&mut rng);
                    for t in n..prefix.time {
                        let value = prefix.rows[0] + (slope + 0.01 * draw) * t as f64;
                        values[(t - n) * settings.samples + k] = value as f32;
                    }
                }
                Samples { count: settings.samples, values }
            };
            Ok(lengths.iter().map(forecast_after).collect())
        }
    }

    /// Generates trajectories that curve away from a straight line after row 10.
    fn curved_trajectories(count: usize, curvature: f64, purpose: &str) -> Sequences {
        let item = |i: usize| {
            let mut rng = random_stream(3, purpose, i as u64);
            let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
            let slope = 0.1 * draw();
            let states = (0..TIME).map(|t| {
                let rows_after = t.saturating_sub(10) as f64;
                slope * t as f64
                    + curvature * rows_after * rows_after
                    + NOISE * if t < 10 { 0.0 } else { draw() }
            });
            Sequence { id: i.to_string(), time: TIME, states: states.collect(), actions: Vec::new() }
        };
        let items = (0..count).map(item).collect();
        Sequences { columns: vec!["x_m".to_owned()], action_columns: Vec::new(), items }
    }

    fn settings() -> FilterSettings {
        FilterSettings { samples: 50, is_measured: true, ..FilterSettings::new(1, 1) }
    }

    fn learn_correction(train: &Sequences) -> Result<ForecastCorrection, TrainerError> {
        let known = (&Sensor::exact(1), &InitialStatePrior::from_training_set(train));
        let lengths = vec![vec![5, 10]; train.items.len()];
        ForecastCorrection::learn(&LinearExtrapolation, train, known, &lengths, settings())
    }

    fn error(model: &dyn PrefixForecaster, test: &Sequences) -> f64 {
        let known = (&Sensor::exact(1), &InitialStatePrior::from_training_set(test));
        let lengths = vec![vec![10]; test.items.len()];
        super::super::evaluate_filtered(model, test, known, &lengths, settings()).unwrap()[0].forecast_rows[0]
    }

    #[test]
    fn a_common_curvature_is_corrected() {
        let (train, test) = (curved_trajectories(40, 1e-3, "train"), curved_trajectories(20, 1e-3, "test"));
        let correction = learn_correction(&train).unwrap();
        let corrected = CorrectedForecaster::new(&LinearExtrapolation, &correction);
        let [before, after] = [error(&LinearExtrapolation, &test), error(&corrected, &test)];
        assert!(after < 0.5 * before, "{before} m before, {after} m after, trust {}", correction.shrinkage());
        let [before_on_train, crossed] = [error(&LinearExtrapolation, &train), {
            error(&CorrectedForecaster::out_of_fold(&LinearExtrapolation, &correction), &train)
        }];
        assert!(crossed < 0.5 * before_on_train, "{before_on_train} m before, {crossed} m after");
    }

    #[test]
    fn noise_is_not_corrected() {
        let (train, test) = (curved_trajectories(40, 0.0, "train"), curved_trajectories(20, 0.0, "test"));
        let correction = learn_correction(&train).unwrap();
        let [before, after] = [
            error(&LinearExtrapolation, &test),
            error(&CorrectedForecaster::new(&LinearExtrapolation, &correction), &test),
        ];
        assert!(
            after < 1.05 * before,
            "{before} m before, {after} m after, trust {}",
            correction.shrinkage()
        );
    }

    #[test]
    fn fewer_trajectories_than_folds_are_refused() {
        assert!(matches!(
            learn_correction(&curved_trajectories(4, 0.0, "train")),
            Err(TrainerError::NoTrajectories { .. })
        ));
    }
}
