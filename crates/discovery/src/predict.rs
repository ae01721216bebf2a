//! Prediction with a fixed model file: every record from its first samples, with bands.
//!
//! Initial states are estimated from the known samples, as for the error tables. The bands are quantiles of
//! simulated draws: parameters from their 95 % intervals (independently, as the file has no correlations),
//! initial states from their posterior at these parameters, event offsets and record-specific parameters
//! from their random effects, and measurement noise. The standard deviation of a random effect is drawn from
//! its interval too: estimated from few draws it is so uncertain that the next draw has Student's
//! distribution, not a normal one.

use crate::addition::Addition;
use crate::evaluate::{Lanes, Point};
use crate::fit::{ChosenRecords, assemble_all};
use crate::forecast::{self, Error, FittedInitialState, ForecastSpan, estimate_initial_state, rmse};
use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::prediction::{
    Draws, PredictOptions, PredictedChannel, PredictedRecord, PredictionError, PredictionSet,
};
use crate::prepare::{PreparedRecords, load_records};
use crate::record::{Measured, Record, RecordWindow};
use crate::{DiscoveryError, error_table};
use augsim_data::{Dataset, random_stream};
use augsim_system::{Declaration, ErrorFigure, NORMAL_95, Parameter, Per, ScatterPer, Window};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::ops::Range;

/// Maximum number of events per record whose offsets of the events' parameter are drawn; later events get
/// none.
const MAX_EVENTS: usize = 32;

/// Predicts every record of `data` by `model`; only initial states are estimated.
///
/// If all states of the system are measured, long records are predicted in parts, as for the error tables.
///
/// # Errors
/// [`DiscoveryError`], if the model and the data are incompatible.
pub fn predict_records(
    model: &dyn Declaration,
    data: &Dataset,
    options: &PredictOptions,
) -> Result<PredictionSet, DiscoveryError> {
    let PreparedRecords { data, noise, .. } = load_records(model, data, 1, false)?;
    let varying = VaryingParameters::predictor(&data);
    let h = fixed_hypothesis(&data, varying.as_ref());
    let theta = h.initial_theta(0.0);
    let spread = standard_deviations(&h, &data);
    let is_requested = |j: &usize| options.is_requested(&data.records[*j].data.id);
    let chosen: Vec<usize> = (0..data.records.len()).filter(is_requested).collect();
    let sample = ChosenRecords { data: &data, chosen: &chosen, correlation: noise.correlation };
    let predictor = Predictor {
        sample: &sample,
        h: &h,
        theta: &theta,
        spread: &spread,
        drawn: varying,
        noise_sd: &noise.sd,
        options,
    };
    let pieces = forecast::whole_spans(&sample);
    let done: Vec<(PredictedRecord, Vec<Error>)> =
        pieces.par_iter().map(|piece| predictor.predict_record(piece)).collect();
    let (records, each): (Vec<PredictedRecord>, Vec<Vec<Error>>) = done.into_iter().unzip();
    let schema = data.system.schema();
    let clusters: Vec<usize> = pieces.iter().map(|piece| chosen[piece.chosen]).collect();
    let listed = |m: usize| -> Vec<Error> { each.iter().map(|errors| errors[m]).collect() };
    let error = |(m, measure): (usize, &ErrorFigure)| {
        // The first measure is given in the unit of its channels, as in the error table.
        let (unit, scale) = match m {
            0 => (error_table::deciding_measure(schema).0, 1.0),
            _ => measure.unit.clone(),
        };
        let list = listed(m);
        let ci95 = forecast::bootstrap(&clusters, &[&list], options.seed, |r| scale * r[0]);
        let channels = measure.channels.clone();
        PredictionError { measure: measure.name.clone(), unit, rmse: scale * rmse(&list), ci95, channels }
    };
    let record = &schema.record[0];
    let start = match &schema.event {
        Some(event) => format!(
            "the part of each {record} before its first {}, or its first two fifths without one",
            event.nouns[0]
        ),
        None if data.is_idealised() => "the first measured state".to_owned(),
        None => format!("the first samples of each {record}"),
    };
    let errors = schema.error_figures.iter().enumerate().map(error).collect();
    Ok(PredictionSet { records, errors, squares: listed(0), noise_sd: noise.sd, start })
}

/// Declared random effect per record: parameters that vary from record to record.
struct VaryingParameters {
    /// Addition that provides the varying parameters if the declared model lacks them. It has no effect at
    /// its null values.
    through: Option<Addition>,
    /// Indices of the varying parameters in the system's parameter vector.
    places: Range<usize>,
    /// Standard deviation between records of each varying parameter, which all have one unit.
    sd: f64,
    /// 95 % interval of the standard deviation, from the model file; `None` if the file has none.
    ci95: Option<[f64; 2]>,
}

impl VaryingParameters {
    /// The random effect per record that the model declares; `None` without one.
    fn predictor(data: &Measured) -> Option<Self> {
        let drawn = data.system.schema().record_random_effect.as_ref()?;
        let (sd, ci95) = (drawn.declared?, drawn.declared_ci95);
        if let Some(places) = drawn.parameters.clone() {
            return Some(Self { through: None, places, sd, ci95 });
        }
        let through = Addition::effect(&*data.system, drawn.effect, Per::All)?;
        let first = data.system.parameters().len();
        Some(Self { places: first..first + through.size(), through: Some(through), sd, ci95 })
    }
}

/// The declared model with its values fixed, for predictions. Parameters with one value per record have a
/// prior about the value in the file, as wide as their bounds, because the first samples may not determine
/// them.
fn fixed_hypothesis(data: &Measured, drawn: Option<&VaryingParameters>) -> Hypothesis {
    let additions: Vec<Addition> = drawn.into_iter().filter_map(|drawn| drawn.through.clone()).collect();
    let mut h = Hypothesis::new(data, &additions);
    for f in h.free.iter_mut().filter(|f| f.per == Per::Trajectory) {
        // Standard deviation of a uniform distribution between the bounds.
        f.prior = Some((h.values[f.index], (f.max - f.min) / 12f64.sqrt()));
    }
    h
}

/// Standard deviation of each entry of theta (shared parameters) from its 95 % interval in the file; 0
/// without one.
fn standard_deviations(h: &Hypothesis, data: &Measured) -> Vec<f64> {
    let standard_deviations = h.free.iter().flat_map(|f| {
        let sd = data.system.parameters().get(f.index).and_then(Parameter::standard_deviation);
        std::iter::repeat_n(sd.unwrap_or(0.0), h.width(f))
    });
    standard_deviations.collect()
}

/// Predicts records by a fixed model, with bands from random draws.
struct Predictor<'a> {
    sample: &'a ChosenRecords<'a>,
    /// The fixed model, with its random effect of the events.
    h: &'a Hypothesis,
    theta: &'a [f64],
    /// Standard deviation of each entry of theta (the shared parameters).
    spread: &'a [f64],
    drawn: Option<VaryingParameters>,
    /// Standard deviation of the measurement noise by channel, in its unit.
    noise_sd: &'a [f64],
    options: &'a PredictOptions,
}

impl Predictor<'_> {
    /// Predicts one record, or a part of a long one. Also returns its error in each measure.
    fn predict_record(&self, piece: &ForecastSpan) -> (PredictedRecord, Vec<Error>) {
        let (data, j) = (self.sample.data, self.sample.chosen[piece.chosen]);
        let (record, theta, options) = (&data.records[j], self.theta, self.options);
        let h = Hypothesis { scatter: None, ..self.h.clone() };
        let (first, samples) = (piece.samples.start, piece.samples.len());
        let start =
            estimate_initial_state(data, record, piece.samples.clone(), &h, theta, self.sample.correlation);
        let whole = Window { samples: piece.samples.clone(), start: Vec::new() };
        let run = start.run(&h, theta, record);
        let (channels, known) = (run.channels(), start.known_end() - first);
        let start_prior = InitialStatePrior::predictor(&start, &h, theta, self.sample.correlation);
        let mut draws = Draws::new(channels, samples, options.draws);
        let bounds = h.fit_bounds();
        let mut rng = random_stream(options.seed, "foretell", j as u64 | (first as u64) << 32);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        for _ in 0..options.draws {
            let drawn: Vec<f64> = (theta.iter().zip(self.spread).zip(&bounds))
                .map(|((t, sd), (low, high))| (t + sd * normal()).clamp(low.min(*t), high.max(*t)))
                .collect();
            let moved: Vec<f64> = drawn.iter().zip(theta).map(|(a, b)| a - b).collect();
            let mut nuisance = start_prior.draw(&moved, &mut normal);
            let mut lanes = start.lanes.clone();
            if let Some(scatter) = self.h.scatter {
                lanes.offsets = if scatter.per == ScatterPer::Record { 1 } else { MAX_EVENTS };
                let sd = random_effect_sd(scatter.sd, scatter.ci95, &mut normal);
                nuisance.extend((0..lanes.offsets).map(|_| sd * normal()));
            }
            let mut point = Point::new(self.h, &*self.h.system, &lanes, record, &drawn, &nuisance);
            if let Some(own) = &self.drawn {
                let sd = random_effect_sd(own.sd, own.ci95, &mut normal);
                let offsets: Vec<f64> = own.places.clone().map(|_| sd * normal()).collect();
                point = point.with_offsets(own.places.start, &offsets);
            }
            let run = point.simulate_plain(&lanes, RecordWindow { record, window: &whole });
            for c in 0..channels {
                for k in 0..samples {
                    let sd = sensor_sd(record, c, first + k, self.noise_sd);
                    draws.push(c, k, run.value(k, c) + sd * normal());
                }
            }
        }
        let schema = data.system.schema();
        let channels = (0..channels).map(|c| {
            let (mean, quantiles) = draws.summary(c);
            let measured = piece
                .samples
                .clone()
                .map(|k| if record.weight[c][k] > 0.0 { record.data.values[c][k] } else { f64::NAN });
            let mut predicted = PredictedChannel {
                column: schema.channels[c].column.clone(),
                measured: measured.collect(),
                forecast: (0..samples).map(|k| run.value(k, c)).collect(),
                mean,
                quantiles,
            };
            predicted.move_to_measured_turn(schema.channels[c].period);
            predicted
        });
        let channels = channels.collect();
        let times = record.data.times[piece.samples.clone()].to_vec();
        let predicted =
            PredictedRecord { id: piece.name(record), times, initial_sample_count: known, channels };
        (predicted, forecast::squares(data, record, &run, first, first + known..piece.samples.end))
    }
}

/// Draws the standard deviation of a random effect from its 95 % interval. The distribution is log-normal on
/// each side of the value `sd`, as the interval was computed.
fn random_effect_sd(sd: f64, ci95: Option<[f64; 2]>, normal: &mut impl FnMut() -> f64) -> f64 {
    let Some([low, high]) = ci95 else { return sd };
    let z = normal();
    // A lower end of 0 means that no scatter fits as well; the upper end then gives the width.
    let side = if z < 0.0 && low > 0.0 { sd / low } else { high / sd };
    let width = side.ln() / NORMAL_95;
    if width.is_finite() && width > 0.0 { sd * (width * z).exp() } else { sd }
}

/// Standard deviation of the measurement noise at a sample: from its weight if it was measured, else that of
/// the channel.
fn sensor_sd(record: &Record, channel: usize, sample: usize, noise_sd: &[f64]) -> f64 {
    let weight = record.weight[channel][sample];
    if weight > 0.0 { 1.0 / weight } else { noise_sd[channel] }
}

/// Normal distribution of the initial state given the known samples of a record. Its mean moves with the
/// parameters.
struct InitialStatePrior<'a> {
    lanes: &'a Lanes,
    mode: &'a [f64],
    /// Curvature `J'WJ` of the cost in parameters and initial state, at the estimated state `mode`.
    curvature: Square,
    /// Lower Cholesky factor of the covariance of the initial state at fixed parameters.
    root: Square,
}

impl<'a> InitialStatePrior<'a> {
    fn predictor(start: &'a FittedInitialState, h: &Hypothesis, theta: &[f64], correlation: f64) -> Self {
        let FittedInitialState { observed_part: known, lanes, nuisance, .. } = start;
        let sample = ChosenRecords { data: known, chosen: &[0], correlation };
        let (lanes_of, starts) = (std::slice::from_ref(lanes), std::slice::from_ref(nuisance));
        let normals = assemble_all(&sample, h, lanes_of, theta, starts);
        let size = lanes.common() + lanes.nuisances();
        let curvature = normals.into_iter().next().map_or_else(|| Square::zero(size), |n| n.h);
        let tail: Vec<usize> = (lanes.common()..curvature.n).collect();
        let covariance = curvature.sub(&tail).cholesky().inverse();
        InitialStatePrior { lanes, mode: nuisance, root: covariance.lower_factor(), curvature }
    }

    /// Draws an initial state for parameters that differ from the fitted ones by `moved`.
    fn draw(&self, moved: &[f64], normal: &mut impl FnMut() -> f64) -> Vec<f64> {
        let common = self.lanes.common();
        let tail: Vec<usize> = (common..self.curvature.n).collect();
        // The most probable initial state at other parameters, to first order.
        let mut x: Vec<f64> = tail
            .iter()
            .map(|&i| {
                -self
                    .lanes
                    .theta
                    .iter()
                    .enumerate()
                    .map(|(a, &t)| self.curvature.at(i, a) * moved[t])
                    .sum::<f64>()
            })
            .collect();
        self.curvature.sub(&tail).cholesky().solve(&mut x);
        let z: Vec<f64> = (0..x.len()).map(|_| normal()).collect();
        let noise = (0..x.len()).map(|i| (0..=i).map(|k| self.root.at(i, k) * z[k]).sum::<f64>());
        self.mode.iter().zip(&x).zip(noise).map(|((m, x), e)| m + x + e).collect()
    }
}
