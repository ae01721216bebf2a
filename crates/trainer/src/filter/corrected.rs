//! A net on what a model's forecasts leave: a recurrent net reads a forecast row by row and corrects it, as the paper's Hybrid reads
//! the physics' roll-out (Ajay et al. 2018, section IV); here the roll-out starts behind the rows seen.
//!
//! The net reads of a row: the median of each column, its way since the row before and the spread of the samples; how many rows were
//! seen, and how far ahead the row is. It gives how far the truth is from the median, in units of the spread, and the scale of what is
//! left. The trajectories are dealt out to five parts; a net is learned without each, and how far the nets are trusted is
//! what serves the parts that they have not seen. A forecast is corrected by the mean of the five.

use super::behind::{FilterSettings, Prefix, PrefixForecaster};
use super::evaluate::each_forecast;
use super::forecast_net::ForecastNet;
use super::{Sensor, StartLaw};
use crate::league::Extents;
use crate::prepared::Prepared;
use crate::scales::positive;
use crate::score::median_of;
use crate::tiles::{Shared, Workspace, clip, gather};
use crate::{Samples, Sequence, Sequences, TrainerError, in_order};
use augsim_data::random_stream;
use augsim_nn::{Adam, AdamState, Params, StepDecay};
use augsim_physics::statistics::median;
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// Parts that the trajectories are dealt out to.
const PARTS: usize = 5;
/// Iterations of each net.
const ITERATIONS: u64 = 400;
/// Forecasts of a batch.
const BATCH: usize = 32;
/// Norm beyond which a gradient is cut.
const CLIP: f64 = 10.0;
/// Learning rate, halved eight times.
const LEARNING_RATE: StepDecay = StepDecay { initial: 3e-3, factor: 0.5, every: ITERATIONS / 8 };
/// Shares of the correction that are compared; 0 keeps the model's median.
const TRUST: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Part of the median spread that is added to the spread: a median of samples that agree is not exact.
const FLOOR: f64 = 0.1;
/// Standard units beyond which a feature is cut: what lies further was never trained on.
const CUT: f64 = 6.0;
/// Features of a column, and of a row besides.
const OF_COLUMN: usize = 3;
const OF_ROW: usize = 2;

/// A correction of a model's forecasts, learned from trajectories.
#[derive(Debug, Clone)]
pub struct ForecastCorrection {
    net: ForecastNet,
    /// Parameters of the nets, each learned without one part.
    params: Vec<Params<f32>>,
    scales: Scales,
    trust: f64,
}

/// Units of features and corrections.
#[derive(Debug, Clone, Default)]
struct Scales {
    /// Mean and standard deviation of the medians of each column.
    mean: Vec<f64>,
    sd: Vec<f64>,
    /// Root mean square of the way of a row.
    way: Vec<f64>,
    /// Median spread.
    spread: Vec<f64>,
    /// Mean number of rows ahead, and of rows seen.
    rows: [f64; 2],
}

/// Median and spread `[rest, S]` of a forecast behind `seen` rows.
struct Summary {
    seen: usize,
    median: Vec<f64>,
    spread: Vec<f64>,
}

impl Summary {
    fn of(samples: &Samples, seen: usize) -> Self {
        let mut sorted = vec![0.0; samples.count];
        let (mut median, mut spread) = (Vec::new(), Vec::new());
        for values in samples.values.chunks_exact(samples.count) {
            median.push(median_of(values, &mut sorted));
            let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.count as f64;
            let square = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>();
            spread.push((square / samples.count as f64).sqrt());
        }
        Summary { seen, median, spread }
    }
}

impl Scales {
    fn fit(all: &[(usize, Summary)], s: usize) -> Self {
        let mut scales = Scales::default();
        let rows: usize = all.iter().map(|(_, one)| one.median.len() / s).sum();
        let count = rows.max(1) as f64;
        for j in 0..s {
            let medians = || all.iter().flat_map(|(_, one)| one.median.iter().skip(j).step_by(s));
            let mean = medians().sum::<f64>() / count;
            let square = medians().map(|v| (v - mean).powi(2)).sum::<f64>();
            let ways = all.iter().flat_map(|(_, one)| one.median.windows(s + 1).skip(j).step_by(s));
            let way = ways.map(|w| (w[s] - w[0]).powi(2)).sum::<f64>();
            let mut spreads: Vec<f64> =
                all.iter().flat_map(|(_, one)| one.spread.iter().skip(j).step_by(s).copied()).collect();
            scales.mean.push(mean);
            scales.sd.push(positive((square / count).sqrt(), 0.0));
            scales.way.push(positive((way / count).sqrt(), 0.0));
            scales.spread.push(positive(if spreads.is_empty() { 0.0 } else { median(&mut spreads) }, 0.0));
        }
        let seen: usize = all.iter().map(|(_, one)| one.seen).sum();
        let many = all.len().max(1) as f64;
        scales.rows = [rows, seen].map(|count| positive(count as f64 / many, 0.0));
        scales
    }

    /// Unit of the corrections of a column where the samples spread so far.
    fn unit(&self, j: usize, spread: f64) -> f64 {
        spread + FLOOR * self.spread[j]
    }

    /// Features `[rest, U]`.
    fn features(&self, one: &Summary) -> Vec<f32> {
        let s = self.mean.len();
        let mut u = Vec::with_capacity(one.median.len() / s * (OF_COLUMN * s + OF_ROW));
        let cut = |v: f64| v.clamp(-CUT, CUT) as f32;
        let rest = one.median.len() / s;
        for t in 0..rest {
            // The way to the first row is not known from the rest alone; that of the second stands for it.
            let (from, to) = if t == 0 { (0, (rest - 1).min(1)) } else { (t - 1, t) };
            for j in 0..s {
                let unit = self.unit(j, one.spread[t * s + j]);
                u.push(cut((one.median[t * s + j] - self.mean[j]) / self.sd[j]));
                u.push(cut((one.median[to * s + j] - one.median[from * s + j]) / self.way[j]));
                u.push(cut((unit / self.spread[j]).ln()));
            }
            u.push(cut((t + 1) as f64 / self.rows[0]));
            u.push(cut(one.seen as f64 / self.rows[1]));
        }
        u
    }

    /// Features and targets of a forecast of a trajectory, up to the first row that was not measured.
    fn prepare(&self, one: &Summary, q: &Sequence) -> Prepared {
        let s = self.mean.len();
        let truth = &q.states[one.seen * s..];
        let time = truth.chunks_exact(s).take_while(|row| row.iter().all(|v| v.is_finite())).count();
        let mut u = self.features(one);
        u.truncate(time * (OF_COLUMN * s + OF_ROW));
        let x = (0..time * s).map(|i| ((truth[i] - one.median[i]) / self.unit(i % s, one.spread[i])) as f32);
        Prepared { time, x_width: s, u_width: OF_COLUMN * s + OF_ROW, x: x.collect(), u }
    }
}

impl ForecastCorrection {
    /// Learns from the forecasts of `model` behind the prefixes `lengths [trajectory][prefix]` (rows, ascending) of the whole
    /// trajectories `train`. What the model itself was fitted to may be the same trajectories where it has few numbers for all of
    /// them.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run, there are fewer trajectories than parts, or training diverges.
    pub fn learn(
        model: &dyn PrefixForecaster,
        train: &Sequences,
        known: (&Sensor, &StartLaw),
        lengths: &[Vec<usize>],
        settings: FilterSettings,
    ) -> Result<Self, TrainerError> {
        if train.items.len() < PARTS {
            return Err(TrainerError::NoTrajectories { what: "the training set, in each of five parts," });
        }
        let s = train.state_dim();
        let summary = |index: usize, n: usize, samples: Samples| (index, Summary::of(&samples, n));
        let forecasts = each_forecast(model, train, known, (lengths, settings), &summary)?;
        let all: Vec<(usize, Summary)> = forecasts.into_iter().flatten().collect();
        let scales = Scales::fit(&all, s);
        let prepared: Vec<(usize, Prepared)> = all
            .iter()
            .map(|(index, one)| (*index, scales.prepare(one, &train.items[*index])))
            .filter(|(_, one)| one.time > 0)
            .collect();
        let extents = Extents { state: s, condition: OF_COLUMN * s + OF_ROW };
        let parts = (0..PARTS).into_par_iter().map(|part| {
            let mut params = Params::new(random_stream(settings.seed, "correction", part as u64));
            let net = ForecastNet::new(extents, &mut params);
            let seen = prepared.iter().filter(|(index, _)| index % PARTS != part);
            descend(&net, &mut params, &seen.map(|(_, one)| one.clone()).collect::<Vec<_>>(), settings.seed)?;
            Ok::<_, TrainerError>((net, params))
        });
        let (mut nets, params): (Vec<ForecastNet>, Vec<Params<f32>>) = in_order(parts)?.into_iter().unzip();
        let mut correction = ForecastCorrection { net: nets.swap_remove(0), params, scales, trust: 0.0 };
        correction.trust = correction.trusted(&prepared);
        Ok(correction)
    }

    /// The share of the correction that leaves least of the forecasts of trajectories that the nets have not seen: mean logarithm of
    /// the mean distance, so that a few trajectories that end otherwise do not decide it.
    fn trusted(&self, prepared: &[(usize, Prepared)]) -> f64 {
        let left = |trust: f64| -> f64 {
            let of = prepared.par_iter().map(|(index, one)| {
                let [centre, _] = self.net.law(&self.params[index % PARTS], &one.u);
                let away =
                    one.x.iter().zip(&centre).map(|(x, c)| (f64::from(*x) - trust * f64::from(*c)).abs());
                (away.sum::<f64>() / one.x.len() as f64).max(f64::MIN_POSITIVE).ln()
            });
            // Collected first: a sum over threads would hang on how they were shared out.
            of.collect::<Vec<f64>>().iter().sum()
        };
        let compared = TRUST.map(|trust| (left(trust), trust));
        compared.iter().fold(compared[0], |best, one| if one.0 < best.0 { *one } else { best }).1
    }

    /// Share of the correction that is applied.
    pub fn trust(&self) -> f64 {
        self.trust
    }
}

/// Trains a net.
fn descend(
    net: &ForecastNet,
    params: &mut Params<f32>,
    all: &[Prepared],
    seed: u64,
) -> Result<(), TrainerError> {
    let adam = Adam { weight_decay: 1e-4, ..Adam::default() };
    let mut state = AdamState::new(params.values().len());
    let mut workspace = Workspace::default();
    let mut grads = vec![0.0; params.values().len()];
    let values: usize = all.iter().map(|one| one.x.len()).sum();
    let mean = values as f64 / all.len().max(1) as f64;
    let batch = BATCH.min(all.len());
    let mut order: Vec<usize> = (0..all.len()).collect();
    for iteration in 0..ITERATIONS {
        order.sort_unstable();
        let mut rng = random_stream(seed, "correction-batch", iteration);
        let (chosen, _) = order.partial_shuffle(&mut rng, batch);
        // Neighbours in length share a tile.
        chosen.sort_unstable_by_key(|&i| (std::cmp::Reverse(all[i].time), i));
        let scale = 1.0 / (batch as f64 * mean);
        workspace.run_all(Shared { net, params: &*params, all, scale, seed }, chosen, 0)?;
        let loss = gather(&workspace.results, scale, &mut grads).misfit;
        let norm = clip(&mut grads, Some(CLIP));
        let rate = LEARNING_RATE.at(iteration);
        if !loss.is_finite() || !norm.is_finite() {
            return Err(TrainerError::Diverged { iteration: iteration + 1, loss, rate });
        }
        adam.step(&mut state, params.values_mut(), &grads, rate);
    }
    Ok(())
}

/// Forecasts of another model, corrected.
#[derive(Clone, Copy)]
pub struct Corrected<'a> {
    model: &'a dyn PrefixForecaster,
    correction: &'a ForecastCorrection,
    is_training_set: bool,
}

impl<'a> Corrected<'a> {
    /// The forecasts of `model`, corrected by the mean of all nets.
    pub fn new(model: &'a dyn PrefixForecaster, correction: &'a ForecastCorrection) -> Self {
        Corrected { model, correction, is_training_set: false }
    }

    /// The same for the trajectories that the correction was learned from, each corrected by the net that has not seen it.
    pub fn crossed(model: &'a dyn PrefixForecaster, correction: &'a ForecastCorrection) -> Self {
        Corrected { model, correction, is_training_set: true }
    }

    /// Centre and scale `[rest, S]` of the corrections of a forecast of the trajectory at a place, in units of [`Scales::unit`].
    fn law(&self, one: &Summary, index: u64) -> [Vec<f64>; 2] {
        let ForecastCorrection { net, params, scales, .. } = self.correction;
        let part = index as usize % PARTS;
        let asked = if self.is_training_set { &params[part..=part] } else { &params[..] };
        let u = scales.features(one);
        let mut mean = [vec![0.0; one.median.len()], vec![0.0; one.median.len()]];
        for params in asked {
            for (mean, law) in mean.iter_mut().zip(net.law(params, &u)) {
                mean.iter_mut().zip(law).for_each(|(mean, v)| *mean += f64::from(v) / asked.len() as f64);
            }
        }
        mean
    }
}

impl PrefixForecaster for Corrected<'_> {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let ForecastCorrection { scales, trust, .. } = self.correction;
        let mut all = self.model.forecasts(prefix, lengths, settings)?;
        for (samples, &n) in all.iter_mut().zip(lengths) {
            let one = Summary::of(samples, n);
            let [centre, scale] = self.law(&one, prefix.index);
            for (i, values) in samples.values.chunks_exact_mut(samples.count).enumerate() {
                let unit = scales.unit(i % scales.mean.len(), one.spread[i]);
                let middle = one.median[i] + trust * unit * centre[i];
                // Samples keep their ranks, so that a path stays a path.
                let factor = if one.spread[i] > 0.0 { unit * scale[i] / one.spread[i] } else { 1.0 };
                for v in values {
                    *v = (middle + factor * (f64::from(*v) - one.median[i])) as f32;
                }
            }
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: what a model leaves of trajectories that no net has seen is learned from others, and a model that leaves noise is left
    //! as it is.
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    const TIME: usize = 30;
    const NOISE: f64 = 0.05;

    /// Straight lines from the last row seen, at the slope of the rows seen.
    struct Straight;

    impl PrefixForecaster for Straight {
        fn forecasts(
            &self,
            prefix: Prefix<'_>,
            lengths: &[usize],
            settings: FilterSettings,
        ) -> Result<Vec<Samples>, TrainerError> {
            let one = |&n: &usize| {
                let slope = (prefix.rows[n - 1] - prefix.rows[0]) / (n - 1) as f64;
                let mut rng = random_stream(settings.seed, "straight", prefix.index);
                let mut values = vec![0.0; (prefix.time - n) * settings.samples];
                for k in 0..settings.samples {
                    let draw: f64 = StandardNormal.sample(&mut rng);
                    for t in n..prefix.time {
                        let at = prefix.rows[0] + (slope + 0.01 * draw) * t as f64;
                        values[(t - n) * settings.samples + k] = at as f32;
                    }
                }
                Samples { count: settings.samples, values }
            };
            Ok(lengths.iter().map(one).collect())
        }
    }

    /// Trajectories that bend away from their straight line behind row 10.
    fn bent(count: usize, bend: f64, purpose: &str) -> Sequences {
        let item = |i: usize| {
            let mut rng = random_stream(3, purpose, i as u64);
            let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
            let slope = 0.1 * draw();
            let states = (0..TIME).map(|t| {
                let behind = t.saturating_sub(10) as f64;
                slope * t as f64 + bend * behind * behind + NOISE * if t < 10 { 0.0 } else { draw() }
            });
            Sequence { id: i.to_string(), time: TIME, states: states.collect(), actions: Vec::new() }
        };
        let items = (0..count).map(item).collect();
        Sequences { columns: vec!["x_m".to_owned()], action_columns: Vec::new(), items }
    }

    fn settings() -> FilterSettings {
        FilterSettings { samples: 50, is_measured: true, ..FilterSettings::new(1, 1) }
    }

    fn learned(train: &Sequences) -> Result<ForecastCorrection, TrainerError> {
        let known = (&Sensor::exact(1), &StartLaw::of(train));
        let lengths = vec![vec![5, 10]; train.items.len()];
        ForecastCorrection::learn(&Straight, train, known, &lengths, settings())
    }

    fn error(model: &dyn PrefixForecaster, test: &Sequences) -> f64 {
        let known = (&Sensor::exact(1), &StartLaw::of(test));
        let lengths = vec![vec![10]; test.items.len()];
        super::super::evaluate_filtered(model, test, known, &lengths, settings()).unwrap()[0].rest[0]
    }

    #[test]
    fn a_bend_that_all_trajectories_have_is_learned() {
        let (train, test) = (bent(40, 1e-3, "train"), bent(20, 1e-3, "test"));
        let correction = learned(&train).unwrap();
        let corrected = Corrected::new(&Straight, &correction);
        let [before, after] = [error(&Straight, &test), error(&corrected, &test)];
        assert!(after < 0.5 * before, "{before} m before, {after} m after, trust {}", correction.trust());
        let [of_train, crossed] =
            [error(&Straight, &train), { error(&Corrected::crossed(&Straight, &correction), &train) }];
        assert!(crossed < 0.5 * of_train, "{of_train} m before, {crossed} m after");
    }

    #[test]
    fn noise_is_not_corrected() {
        let (train, test) = (bent(40, 0.0, "train"), bent(20, 0.0, "test"));
        let correction = learned(&train).unwrap();
        let [before, after] =
            [error(&Straight, &test), error(&Corrected::new(&Straight, &correction), &test)];
        assert!(after < 1.05 * before, "{before} m before, {after} m after, trust {}", correction.trust());
    }

    #[test]
    fn fewer_trajectories_than_parts_are_refused() {
        assert!(matches!(learned(&bent(4, 0.0, "train")), Err(TrainerError::NoTrajectories { .. })));
    }
}
