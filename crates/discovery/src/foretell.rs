//! A model file run as it stands: every record forecast from its first samples, with bands.
//!
//! The start of a record is fitted to its known samples as in the table of errors. Bands are those of draws: parameters from
//! their 95 % intervals (one independent of the other, as the file has them), the start from what the known samples leave
//! open at those parameters, the parameter of the events from its scatter, and the sensor's noise on top.

use crate::evaluate::{Lanes, Point};
use crate::fit::{Sample, assembled};
use crate::forecast::{self, Begun, Error, begun, rmse};
use crate::foretold::{Draws, ForetellOptions, Foretelling, Foretold, ForetoldChannel, ForetoldError};
use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::prepare::{Readied, ready};
use crate::record::{Excerpt, Measured, Record};
use crate::{DiscoveryError, error_table};
use augsim_data::{Dataset, random_stream};
use augsim_physics::model::Per;
use augsim_physics::system::{Declaration, ScatterPer, Window};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Events of one record that have an offset of their own; later ones have none.
const MOST_EVENTS: usize = 32;
/// Widths of a 95 % interval in standard deviations.
const INTERVAL: f64 = 2.0 * 1.959_963_984_540_054;

/// Forecasts every record of `data` by `model` as it stands: nothing is fitted but starts.
///
/// # Errors
/// [`DiscoveryError`], where model and data do not go together.
pub fn foretell(
    model: &dyn Declaration,
    data: &Dataset,
    options: &ForetellOptions,
) -> Result<Foretelling, DiscoveryError> {
    let Readied { data, noise, .. } = ready(model, data, 1, false)?;
    let h = as_it_stands(&data);
    let theta = h.theta_start(0.0);
    let spread = spread(&h, &data);
    let asked = |j: &usize| options.asks_for(&data.records[*j].seen.id);
    let everything: Vec<usize> = (0..data.records.len()).filter(asked).collect();
    let sample = Sample { data: &data, chosen: &everything, correlation: noise.correlation };
    let done: Vec<(Foretold, Error)> =
        everything.par_iter().map(|&j| one(&sample, j, &h, &theta, &spread, &noise.sd, options)).collect();
    let (records, errors): (Vec<Foretold>, Vec<Error>) = done.into_iter().unzip();
    let schema = data.system.schema();
    let (unit, _) = error_table::measured_in(schema);
    let measure = schema.measures.first().map_or(String::new(), |m| m.name.clone());
    let ci95 = forecast::bootstrap(&everything, &[&errors], options.seed, |r| r[0]);
    let error = ForetoldError { measure, unit, rmse: rmse(&errors), ci95 };
    let record = &schema.record[0];
    let start = match &schema.event {
        Some(event) => format!(
            "the part of each {record} before its first {}, or its first two fifths without one",
            event.words[0]
        ),
        None => format!("the first samples of each {record}"),
    };
    Ok(Foretelling { records, errors: vec![error], squares: errors, noise_sd: noise.sd, start })
}

/// The declared model as a predictor. A trajectory's own parameters are drawn towards the values in the file, as far as its
/// bounds let them differ: the first samples may say little about them.
fn as_it_stands(data: &Measured) -> Hypothesis {
    let mut h = Hypothesis::new(data, &[]);
    for f in h.free.iter_mut().filter(|f| f.per == Per::Trajectory) {
        // The standard deviation of a uniform law between the bounds.
        f.prior = Some((h.values[f.index], (f.max - f.min) / 12f64.sqrt()));
    }
    h
}

/// Standard deviation of each entry of theta: what its 95 % interval in the file says, 0 without one.
fn spread(h: &Hypothesis, data: &Measured) -> Vec<f64> {
    let each = h.free.iter().flat_map(|f| {
        let ci95 = data.system.parameters().get(f.index).and_then(|p| p.ci95);
        let sd = ci95.map_or(0.0, |[low, high]| (high - low) / INTERVAL);
        std::iter::repeat_n(if sd.is_finite() { sd } else { 0.0 }, h.width(f))
    });
    each.collect()
}

/// One record and its error in the measure that decides.
fn one(
    sample: &Sample<'_>,
    j: usize,
    scattered: &Hypothesis,
    theta: &[f64],
    spread: &[f64],
    noise_sd: &[f64],
    options: &ForetellOptions,
) -> (Foretold, Error) {
    let (data, record) = (sample.data, &sample.data.records[j]);
    let h = Hypothesis { scatter: None, ..scattered.clone() };
    let everything = 0..record.seen.times.len();
    let start = begun(data, record, everything.clone(), &h, theta, sample.correlation);
    let whole = Window { samples: everything, start: Vec::new() };
    let run = start.run(&h, theta, record);
    let (channels, samples, known) = (run.channels(), run.samples(), record.seen.known);
    let law = StartLaw::of(&start, &h, theta, sample.correlation);
    let mut draws = Draws::new(channels, samples, options.draws);
    let bounds = h.bounds();
    let mut rng = random_stream(options.seed, "foretell", j as u64);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    for _ in 0..options.draws {
        let drawn: Vec<f64> = (theta.iter().zip(spread).zip(&bounds))
            .map(|((t, sd), (low, high))| (t + sd * normal()).clamp(low.min(*t), high.max(*t)))
            .collect();
        let moved: Vec<f64> = drawn.iter().zip(theta).map(|(a, b)| a - b).collect();
        let mut nuisance = law.draw(&moved, &mut normal);
        let mut lanes = start.lanes.clone();
        if let Some(scatter) = scattered.scatter {
            lanes.offsets = if scatter.per == ScatterPer::Record { 1 } else { MOST_EVENTS };
            nuisance.extend((0..lanes.offsets).map(|_| scatter.sd * normal()));
        }
        let point = Point::new(scattered, &*scattered.system, &lanes, record, &drawn, &nuisance);
        let run = point.plain(&lanes, Excerpt { record, window: &whole });
        for c in 0..channels {
            for k in 0..samples {
                let sd = sensor_sd(record, c, k, noise_sd);
                draws.push(c, k, run.value(k, c) + sd * normal());
            }
        }
    }
    let schema = data.system.schema();
    let channels = (0..channels).map(|c| {
        let (mean, quantiles) = draws.summary(c);
        let used = |k: usize| record.weight[c][k] > 0.0;
        ForetoldChannel {
            column: schema.channels[c].column.clone(),
            measured: (0..samples)
                .map(|k| if used(k) { record.seen.values[c][k] } else { f64::NAN })
                .collect(),
            forecast: (0..samples).map(|k| run.value(k, c)).collect(),
            mean,
            quantiles,
        }
    });
    let channels = channels.collect();
    let foretold = Foretold { id: record.seen.id.clone(), times: record.seen.times.clone(), known, channels };
    let errors = forecast::squares(data, record, &run, 0, known..samples);
    (foretold, errors.first().copied().unwrap_or_default())
}

/// Standard deviation of the sensor at a sample: that of the sample where it was measured, that of the channel elsewhere.
fn sensor_sd(record: &Record, channel: usize, sample: usize, noise_sd: &[f64]) -> f64 {
    let weight = record.weight[channel][sample];
    if weight > 0.0 { 1.0 / weight } else { noise_sd[channel] }
}

/// The law of a record's start given its known samples: normal about the fitted one, which moves along with the parameters.
struct StartLaw<'a> {
    lanes: &'a Lanes,
    mode: &'a [f64],
    /// `J'WJ` of all lanes at the mode.
    curvature: Square,
    /// Lower factor of the covariance of the start at given parameters.
    root: Square,
}

impl<'a> StartLaw<'a> {
    fn of(start: &'a Begun, h: &Hypothesis, theta: &[f64], correlation: f64) -> Self {
        let Begun { known, lanes, nuisance, .. } = start;
        let sample = Sample { data: known, chosen: &[0], correlation };
        let (lanes_of, starts) = (std::slice::from_ref(lanes), std::slice::from_ref(nuisance));
        let normals = assembled(&sample, h, lanes_of, theta, starts);
        let size = lanes.common() + lanes.nuisances();
        let curvature = normals.into_iter().next().map_or_else(|| Square::zero(size), |n| n.h);
        let tail: Vec<usize> = (lanes.common()..curvature.n).collect();
        let covariance = curvature.sub(&tail).cholesky().inverse();
        StartLaw { lanes, mode: nuisance, root: covariance.root(), curvature }
    }

    /// A draw, where the parameters stand off the values of the fit by `moved`.
    fn draw(&self, moved: &[f64], normal: &mut impl FnMut() -> f64) -> Vec<f64> {
        let common = self.lanes.common();
        let tail: Vec<usize> = (common..self.curvature.n).collect();
        // The most probable start at other parameters, to first order.
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
