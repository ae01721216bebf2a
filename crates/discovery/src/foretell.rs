//! A model file run as it stands: every record forecast from its first samples, with bands.
//!
//! The start of a record is fitted to its known samples as in the table of errors. Bands are those of draws: parameters from
//! their 95 % intervals (one independent of the other, as the file has them), the start from what the known samples leave
//! open at those parameters, the parameter of the events from its scatter, parameters that are drawn anew for each record from
//! theirs, and the sensor's noise on top. The standard deviation of a scatter is drawn from its interval as well: over few
//! draws it is so uncertain that the law of the next one is Student's, not the normal law.

use crate::addition::Addition;
use crate::evaluate::{Lanes, Point};
use crate::fit::{ChosenRecords, assembled};
use crate::forecast::{self, Begun, Error, ForecastSpan, begun, rmse};
use crate::foretold::{Draws, ForetellOptions, Foretelling, Foretold, ForetoldChannel, ForetoldError};
use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::prepare::{Readied, ready};
use crate::record::{Excerpt, Measured, Record};
use crate::{DiscoveryError, error_table};
use augsim_data::{Dataset, random_stream};
use augsim_physics::model::{NORMAL_95, Parameter, Per};
use augsim_physics::system::{Declaration, Measure, ScatterPer, Window};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::ops::Range;

/// Events of one record that have an offset of their own; later ones have none.
const MOST_EVENTS: usize = 32;

/// Forecasts every record of `data` by `model` as it stands: nothing is fitted but starts. Long records of a system whose states
/// are all measured are forecast in pieces, as in the table of errors.
///
/// # Errors
/// [`DiscoveryError`], where model and data do not go together.
pub fn foretell(
    model: &dyn Declaration,
    data: &Dataset,
    options: &ForetellOptions,
) -> Result<Foretelling, DiscoveryError> {
    let Readied { data, noise, .. } = ready(model, data, 1, false)?;
    let drawn = Redrawn::of(&data);
    let h = as_it_stands(&data, drawn.as_ref());
    let theta = h.theta_start(0.0);
    let spread = spread(&h, &data);
    let asked = |j: &usize| options.asks_for(&data.records[*j].seen.id);
    let chosen: Vec<usize> = (0..data.records.len()).filter(asked).collect();
    let sample = ChosenRecords { data: &data, chosen: &chosen, correlation: noise.correlation };
    let of =
        Of { sample: &sample, h: &h, theta: &theta, spread: &spread, drawn, noise_sd: &noise.sd, options };
    let pieces = forecast::whole(&sample);
    let done: Vec<(Foretold, Vec<Error>)> = pieces.par_iter().map(|piece| of.one(piece)).collect();
    let (records, each): (Vec<Foretold>, Vec<Vec<Error>>) = done.into_iter().unzip();
    let schema = data.system.schema();
    let clusters: Vec<usize> = pieces.iter().map(|piece| chosen[piece.chosen]).collect();
    let listed = |m: usize| -> Vec<Error> { each.iter().map(|errors| errors[m]).collect() };
    let error = |(m, measure): (usize, &Measure)| {
        // The first is told in the unit of its channels, as in the table of errors.
        let (unit, scale) = match m {
            0 => (error_table::measured_in(schema).0, 1.0),
            _ => measure.unit.clone(),
        };
        let list = listed(m);
        let ci95 = forecast::bootstrap(&clusters, &[&list], options.seed, |r| scale * r[0]);
        ForetoldError { measure: measure.name.clone(), unit, rmse: scale * rmse(&list), ci95 }
    };
    let record = &schema.record[0];
    let start = match &schema.event {
        Some(event) => format!(
            "the part of each {record} before its first {}, or its first two fifths without one",
            event.words[0]
        ),
        None if data.is_idealised() => "the first measured state".to_owned(),
        None => format!("the first samples of each {record}"),
    };
    let errors = schema.measures.iter().enumerate().map(error).collect();
    Ok(Foretelling { records, errors, squares: listed(0), noise_sd: noise.sd, start })
}

/// Parameters that are drawn anew for each record.
struct Redrawn {
    /// Addition that has the scattered parameters where the declared model has not: they vanish at their nulls.
    through: Option<Addition>,
    /// Their places in the system's vector.
    places: Range<usize>,
    /// Standard deviation of each, in its unit.
    sd: f64,
    /// Its 95 % interval in the model file.
    ci95: Option<[f64; 2]>,
}

impl Redrawn {
    /// The scatter that the model declares; `None` where it declares none.
    fn of(data: &Measured) -> Option<Self> {
        let drawn = data.system.schema().drawn.as_ref()?;
        let (sd, ci95) = (drawn.declared?, drawn.declared_ci95);
        if let Some(places) = drawn.places.clone() {
            return Some(Self { through: None, places, sd, ci95 });
        }
        let through = Addition::effect(&*data.system, drawn.through, Per::All)?;
        let first = data.system.parameters().len();
        Some(Self { places: first..first + through.size(), through: Some(through), sd, ci95 })
    }
}

/// The declared model as a predictor. A trajectory's own parameters are drawn towards the values in the file, as far as its
/// bounds let them differ: the first samples may say little about them.
fn as_it_stands(data: &Measured, drawn: Option<&Redrawn>) -> Hypothesis {
    let additions: Vec<Addition> = drawn.into_iter().filter_map(|drawn| drawn.through.clone()).collect();
    let mut h = Hypothesis::new(data, &additions);
    for f in h.free.iter_mut().filter(|f| f.per == Per::Trajectory) {
        // The standard deviation of a uniform law between the bounds.
        f.prior = Some((h.values[f.index], (f.max - f.min) / 12f64.sqrt()));
    }
    h
}

/// Standard deviation of each entry of theta: what its 95 % interval in the file says, 0 without one.
fn spread(h: &Hypothesis, data: &Measured) -> Vec<f64> {
    let each = h.free.iter().flat_map(|f| {
        let sd = data.system.parameters().get(f.index).and_then(Parameter::standard_deviation);
        std::iter::repeat_n(sd.unwrap_or(0.0), h.width(f))
    });
    each.collect()
}

/// Records that are foretold, the model with its scatter, and the settings.
struct Of<'a> {
    sample: &'a ChosenRecords<'a>,
    /// The model, with its scatter.
    h: &'a Hypothesis,
    theta: &'a [f64],
    /// Standard deviation of each entry of theta.
    spread: &'a [f64],
    drawn: Option<Redrawn>,
    /// Standard deviation of the sensor by channel.
    noise_sd: &'a [f64],
    options: &'a ForetellOptions,
}

impl Of<'_> {
    /// One record, or a piece of a long one, and its error in each measure.
    fn one(&self, piece: &ForecastSpan) -> (Foretold, Vec<Error>) {
        let (data, j) = (self.sample.data, self.sample.chosen[piece.chosen]);
        let (record, theta, options) = (&data.records[j], self.theta, self.options);
        let h = Hypothesis { scatter: None, ..self.h.clone() };
        let (first, samples) = (piece.samples.start, piece.samples.len());
        let start = begun(data, record, piece.samples.clone(), &h, theta, self.sample.correlation);
        let whole = Window { samples: piece.samples.clone(), start: Vec::new() };
        let run = start.run(&h, theta, record);
        let (channels, known) = (run.channels(), start.end_of_known() - first);
        let law = StartLaw::of(&start, &h, theta, self.sample.correlation);
        let mut draws = Draws::new(channels, samples, options.draws);
        let bounds = h.bounds();
        let mut rng = random_stream(options.seed, "foretell", j as u64 | (first as u64) << 32);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        for _ in 0..options.draws {
            let drawn: Vec<f64> = (theta.iter().zip(self.spread).zip(&bounds))
                .map(|((t, sd), (low, high))| (t + sd * normal()).clamp(low.min(*t), high.max(*t)))
                .collect();
            let moved: Vec<f64> = drawn.iter().zip(theta).map(|(a, b)| a - b).collect();
            let mut nuisance = law.draw(&moved, &mut normal);
            let mut lanes = start.lanes.clone();
            if let Some(scatter) = self.h.scatter {
                lanes.offsets = if scatter.per == ScatterPer::Record { 1 } else { MOST_EVENTS };
                let sd = drawn_sd(scatter.sd, scatter.ci95, &mut normal);
                nuisance.extend((0..lanes.offsets).map(|_| sd * normal()));
            }
            let mut point = Point::new(self.h, &*self.h.system, &lanes, record, &drawn, &nuisance);
            if let Some(own) = &self.drawn {
                let sd = drawn_sd(own.sd, own.ci95, &mut normal);
                let offsets: Vec<f64> = own.places.clone().map(|_| sd * normal()).collect();
                point = point.moved(own.places.start, &offsets);
            }
            let run = point.plain(&lanes, Excerpt { record, window: &whole });
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
                .map(|k| if record.weight[c][k] > 0.0 { record.seen.values[c][k] } else { f64::NAN });
            ForetoldChannel {
                column: schema.channels[c].column.clone(),
                measured: measured.collect(),
                forecast: (0..samples).map(|k| run.value(k, c)).collect(),
                mean,
                quantiles,
            }
        });
        let channels = channels.collect();
        let times = record.seen.times[piece.samples.clone()].to_vec();
        let foretold = Foretold { id: piece.name(record), times, known, channels };
        (foretold, forecast::squares(data, record, &run, first, first + known..piece.samples.end))
    }
}

/// A draw of a standard deviation with this 95 % interval: log-normal to each side of its value, which is how the interval was
/// made.
fn drawn_sd(sd: f64, ci95: Option<[f64; 2]>, normal: &mut impl FnMut() -> f64) -> f64 {
    let Some([low, high]) = ci95 else { return sd };
    let z = normal();
    // A lower end of 0 says that no scatter fits as well: the upper side then tells how wide the law is.
    let side = if z < 0.0 && low > 0.0 { sd / low } else { high / sd };
    let width = side.ln() / NORMAL_95;
    if width.is_finite() && width > 0.0 { sd * (width * z).exp() } else { sd }
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
        let sample = ChosenRecords { data: known, chosen: &[0], correlation };
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
