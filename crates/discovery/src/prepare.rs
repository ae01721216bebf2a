//! From a data set to records with events, noise and a split.

use crate::calibrate::calibrate;
use crate::cut::Clock;
use crate::fit::{ChosenRecords, Fit};
use crate::framed::framed;
use crate::lone;
use crate::noise::{Noise, estimate};
use crate::pieces;
use crate::record::Measured;
use crate::records::parts::divided;
use crate::residuals::left;
use crate::rough_noise::{between_neighbours, rough_noise};
use crate::spikes::{mask, spikes};
use crate::statistics::median;
use crate::{DiscoveryError, Options};
use augsim_data::Dataset;
use augsim_physics::model::unknown_group;
use augsim_physics::system::{Declaration, Record as Seen, spread};

/// Data ready for fits.
#[derive(Clone)]
pub(crate) struct Prepared {
    pub data: Measured,
    pub noise: Noise,
    /// Whether polynomials follow the motion between samples, so that what they leave is noise.
    pub smooth: bool,
    /// Records that are searched.
    pub searched: Vec<usize>,
    /// Records that are kept out from the beginning, on which errors are measured; none where there are too few.
    pub kept_out: Vec<usize>,
    /// Remarks on the records that the result repeats for its reader, one sentence each.
    pub notes: Vec<String>,
    /// The time that all searches on these data have together.
    pub clock: Clock,
}

impl Prepared {
    /// Some of the trajectories, with the noise of all.
    pub fn sample<'a>(&'a self, chosen: &'a [usize]) -> ChosenRecords<'a> {
        ChosenRecords { data: &self.data, chosen, correlation: self.noise.correlation }
    }

    /// Spread of the quantity that decides about its mean, in the unit of its channels.
    pub fn spread(&self) -> f64 {
        let records: Vec<Seen> = self.data.records.iter().map(|r| r.seen.clone()).collect();
        let Some(measure) = self.data.system.schema().measures.first() else { return f64::INFINITY };
        let squares: f64 = measure.channels.iter().map(|&channel| spread(&records, channel).powi(2)).sum();
        let count = if measure.length { 1 } else { measure.channels.len().max(1) };
        (squares / count as f64).sqrt()
    }

    /// Whether the noise is only bounded from above, by what polynomials leave that do not follow the motion.
    pub fn is_bounded(&self) -> bool {
        !self.smooth && !self.data.is_idealised()
    }

    /// The same with less noise, where a fit of the training part shows that the estimate was too high: samples too few for
    /// polynomials to follow the motion only bound it from above, by the misfit of a model that lacks something.
    pub fn quieter(&mut self, found: Vec<f64>) -> bool {
        if !self.is_bounded() {
            return false;
        }
        let ratios: Vec<f64> = found
            .iter()
            .zip(&self.noise.sd)
            .map(|(found, sd)| if *found > 0.0 { (found.max(QUIETEST) / sd).min(1.0) } else { 1.0 })
            .collect();
        if ratios.iter().all(|ratio| *ratio > TELLING) {
            return false;
        }
        for sds in [&mut self.noise.sd, &mut self.noise.white] {
            sds.iter_mut().zip(&ratios).for_each(|(sd, ratio)| *sd *= ratio);
        }
        for record in &mut self.data.records {
            for (weights, ratio) in record.weight.iter_mut().zip(&ratios) {
                weights.iter_mut().for_each(|w| *w /= ratio);
            }
        }
        true
    }
}

/// Noise that is not told from none, in the unit of any channel, as in [`estimate`].
const QUIETEST: f64 = 1e-6;
/// Ratio of a new estimate of the noise to the old one above which nothing changes.
const TELLING: f64 = 0.9;

/// Standard deviation of a fit's residuals in each channel; freedom is the number of samples less the starts of windows and
/// the parameters.
pub(crate) fn misfit(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<f64> {
    let left = left(sample, fit);
    let channels = sample.data.system.schema().channels.len();
    let each = |c: usize| left.iter().flat_map(move |l| l.residuals[c].iter().filter(|r| r.is_finite()));
    let counts: Vec<f64> = (0..channels).map(|c| each(c).count() as f64).collect();
    let all: f64 = counts.iter().sum();
    let fitted = left.iter().map(|l| l.nuisances).sum::<usize>() + fit.theta.len();
    let share = (1.0 - fitted as f64 / all.max(1.0)).max(0.1);
    (0..channels)
        .map(|c| (each(c).map(|r| r * r).sum::<f64>() / (share * counts[c]).max(1.0)).sqrt())
        .collect()
}

/// Records from which on a fifth is kept out: fewer than four would say little.
const ENOUGH_RECORDS: usize = 20;
/// One in so many records is kept out, by their order.
const KEPT_OUT: usize = 5;

/// Records with their noise.
pub(crate) struct Readied {
    pub data: Measured,
    pub noise: Noise,
    /// Whether polynomials follow the motion between samples.
    pub smooth: bool,
    /// Remarks on the records for the reader of the result, one sentence each.
    pub notes: Vec<String>,
}

pub(crate) fn prepare(
    model: &dyn Declaration,
    dataset: &Dataset,
    options: &Options,
) -> Result<Prepared, DiscoveryError> {
    let framed = framed(model, dataset)?;
    let steady = framed.as_ref().map_or(dataset, |(steady, _)| steady);
    let Readied { data, mut noise, smooth, mut notes } = ready(model, steady, 2, true)?;
    if let Some((_, clock)) = framed {
        notes.push(format!(
            "time stamps jitter by {:.2} ms about frames of {:.3} ms, on which the samples were put",
            1e3 * clock.jitter_s,
            1e3 * clock.period_s
        ));
        noise.put_on_frames(clock);
    }
    let (searched, kept_out) = kept_out(&data);
    Ok(Prepared { data, noise, smooth, searched, kept_out, notes, clock: Clock::new(options) })
}

/// Records that are searched, and those that are kept out: one in five of each group by their order, where there are enough whole ones.
fn kept_out(data: &Measured) -> (Vec<usize>, Vec<usize>) {
    let everything: Vec<usize> = (0..data.records.len()).collect();
    let recordings = if data.recordings.is_empty() { everything.len() } else { data.recordings.len() };
    if recordings < ENOUGH_RECORDS || data.records.len() != recordings {
        return (everything, Vec::new());
    }
    let mut met = vec![0; data.groups.len()];
    let is_searched = |j: &usize| {
        let count = &mut met[data.records[*j].seen.group];
        *count += 1;
        // The middle one of each five: the first and the last of a session are the least like the others.
        *count % KEPT_OUT != KEPT_OUT.div_ceil(2)
    };
    everything.into_iter().partition(is_searched)
}

/// Reads records with events and noise; `fewest` are needed. What the system has against fits to them is asked where they are
/// fitted to (`is_fitted`).
pub(crate) fn ready(
    model: &dyn Declaration,
    dataset: &Dataset,
    fewest: usize,
    is_fitted: bool,
) -> Result<Readied, DiscoveryError> {
    let mut data = Measured::from_dataset(dataset, model)?;
    let names: Vec<&str> = data.groups.iter().map(String::as_str).collect();
    if let Some(unknown) = unknown_group(data.system.parameters().iter(), &names) {
        return Err(DiscoveryError::unknown_group(model.file(), &data.name, unknown, &data.groups));
    }
    let channels = 0..data.system.schema().channels.len();
    let rough: Vec<f64> = channels
        .map(|c| {
            let each = data.records.iter().map(|r| rough_noise(&r.seen.times, &r.seen.values[c]));
            median(&mut each.collect::<Vec<_>>())
        })
        .collect();
    let system = data.system.clone();
    let mut notes = Vec::new();
    if let [only] = &data.records[..]
        && is_fitted
        && let Some((halves, at_s)) = lone::halves(&*system, only, &rough)
    {
        notes.push(format!(
            "one {} only: it was cut at {at_s:.2} s, and each part is forecast by what the other shows; what differs between \
             {} cannot be seen",
            system.schema().record[0],
            system.schema().record[1]
        ));
        data.records = halves;
    }
    data.records.retain_mut(|r| system.prepare(&mut r.seen, &rough).is_ok());
    if let Some(settled) = system.settled(&data.seen()) {
        data.system = settled;
    }
    let system = data.system.clone();
    let smooth = !data.is_idealised() && pieces::find(&mut data);
    (data.records, data.recordings) = divided(std::mem::take(&mut data.records));
    if data.is_idealised() {
        // A run that drifts as its laws are wrong says nothing of what was added.
        data.recordings.clear();
    }
    let found = data.records.len();
    if found < fewest {
        let data = data.name;
        return Err(DiscoveryError::TooFew { data, found });
    }
    let mut noise =
        if data.is_idealised() { between_neighbours(&mut data) } else { estimate(&mut data, smooth) };
    data.white_share = noise.white_share();
    if is_fitted && let Some(objection) = system.objection(&without_outliers(&data), &noise.sd) {
        let (data, model) = (data.name, model.file().into());
        return Err(DiscoveryError::Objection { data, model, objection });
    }
    let everything: Vec<usize> = (0..data.records.len()).collect();
    if noise.findings.contains(&"outliers") {
        let sample = ChosenRecords { data: &data, chosen: &everything, correlation: noise.correlation };
        let found = spikes(&sample, &calibrate(&sample));
        noise.outliers += found.len();
        mask(&mut data, &found);
    }
    Ok(Readied { data, noise, smooth, notes })
}

/// The records as the system sees them; samples that were masked are not measured.
fn without_outliers(data: &Measured) -> Vec<Seen> {
    let mut records: Vec<Seen> = data.records.iter().map(|r| r.seen.clone()).collect();
    for (seen, record) in records.iter_mut().zip(&data.records) {
        for (values, weights) in seen.values.iter_mut().zip(&record.weight) {
            values.iter_mut().zip(weights).filter(|(_, w)| **w == 0.0).for_each(|(v, _)| *v = f64::NAN);
        }
    }
    records
}
