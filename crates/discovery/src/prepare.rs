//! From a data set to records with events, noise and a split.

use crate::blocks::divided;
use crate::calibrate::calibrate;
use crate::deal;
use crate::fit::Sample;
use crate::noise::{Noise, estimate};
use crate::pieces;
use crate::record::Measured;
use crate::rough_noise::{between_neighbours, rough_noise};
use crate::spikes::{mask, spikes};
use crate::statistics::median;
use crate::{DiscoveryError, Options};
use augsim_data::Dataset;
use augsim_physics::model::unknown_group;
use augsim_physics::system::{Declaration, Record as Seen};

/// Data ready for fits.
pub(crate) struct Prepared {
    pub data: Measured,
    pub noise: Noise,
    pub train: Vec<usize>,
    pub test: Vec<usize>,
}

impl Prepared {
    /// Some of the trajectories, with the noise of all.
    pub fn sample<'a>(&'a self, chosen: &'a [usize]) -> Sample<'a> {
        Sample { data: &self.data, chosen, correlation: self.noise.correlation }
    }
}

/// Samples of blocks that are enough to search on.
const MOST_SAMPLES: usize = 16_000;
/// Blocks that are used at least.
const FEWEST_BLOCKS: usize = 5;
/// Held-out trajectories below which half of all is held out.
const FEWEST_HELD_OUT: f64 = 8.0;

pub(crate) fn prepare(
    model: &dyn Declaration,
    dataset: &Dataset,
    options: &Options,
) -> Result<Prepared, DiscoveryError> {
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
    data.records.retain_mut(|r| system.prepare(&mut r.seen, &rough).is_ok());
    let smooth = !data.is_idealised() && pieces::find(&mut data);
    data.records = divided(std::mem::take(&mut data.records));
    let found = data.records.len();
    if found < 2 {
        let data = data.name;
        return Err(DiscoveryError::TooFew { data, found });
    }
    let mut noise =
        if data.is_idealised() { between_neighbours(&mut data) } else { estimate(&mut data, smooth) };
    data.white_share = noise.white_share();
    if let Some(objection) = system.objection(&without_outliers(&data), &noise.sd) {
        let (data, model) = (data.name, model.file().into());
        return Err(DiscoveryError::Objection { data, model, objection });
    }
    let everything: Vec<usize> = (0..data.records.len()).collect();
    if noise.findings.contains(&"outliers") {
        let sample = Sample { data: &data, chosen: &everything, correlation: noise.correlation };
        let found = spikes(&sample, &calibrate(&sample));
        noise.outliers += found.len();
        mask(&mut data, &found);
    }
    let (mut train, mut test) = split(&data, &everything, options);
    shorten(&data, &mut train, MOST_SAMPLES);
    shorten(&data, &mut test, MOST_SAMPLES / 2);
    Ok(Prepared { data, noise, train, test })
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

/// Leaves out blocks of long records where all have more than `most` samples, those that stay lying all over the record: a
/// search gains little from more.
fn shorten(data: &Measured, chosen: &mut Vec<usize>, most: usize) {
    if !data.records.iter().any(|r| r.seen.under_way) {
        return;
    }
    let samples: usize = chosen.iter().map(|&j| data.records[j].seen.times.len()).sum();
    let kept = (chosen.len() * most / samples.max(1)).clamp(FEWEST_BLOCKS, chosen.len().max(FEWEST_BLOCKS));
    if kept < chosen.len() {
        *chosen = (0..kept).map(|i| chosen[i * chosen.len() / kept]).collect();
    }
}

/// Deals the trajectories `among` out to training and test.
pub(crate) fn split(data: &Measured, among: &[usize], options: &Options) -> (Vec<usize>, Vec<usize>) {
    // Few trajectories: the half that is held out says more than three or four would. Records of many windows say enough.
    let few = !data.is_idealised() && (1.0 - options.train_share) * (among.len() as f64) < FEWEST_HELD_OUT;
    let share = if few { options.train_share.min(0.5) } else { options.train_share };
    deal::split(&data.group_of(), among, share, options.seed)
}
