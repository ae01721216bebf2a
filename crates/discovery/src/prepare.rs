//! From a data set to records with impacts, noise and a split.

use crate::calibrate::calibrate;
use crate::deal;
use crate::fit::Sample;
use crate::noise::{Noise, estimate};
use crate::record::{Measured, Record};
use crate::segment::{rough_noise, segment};
use crate::spikes::{mask, spikes};
use crate::statistics::median;
use crate::{DiscoveryError, Options};
use augsim_data::Dataset;
use augsim_physics::ball::{GRAVITY, RESTITUTION};
use augsim_physics::model::Model;

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

/// Held-out trajectories below which half of all is held out.
const FEWEST_HELD_OUT: f64 = 8.0;
/// Fewest measured heights of a trajectory that is used.
const FEWEST: usize = 8;

pub(crate) fn prepare(
    model: &Model,
    dataset: &Dataset,
    options: &Options,
) -> Result<Prepared, DiscoveryError> {
    let mut data = Measured::from_dataset(dataset, model)?;
    if let Some(unknown) = model.unknown_group(&data.groups.iter().map(String::as_str).collect::<Vec<_>>()) {
        return Err(DiscoveryError::unknown_group(&model.file, &data.name, unknown, &data.groups));
    }
    let vertical = data.axes.count() - 1;
    let mut rough: Vec<f64> = data.records.iter().map(|r| rough_noise(&r.times, &r.y[vertical])).collect();
    let sigma = median(&mut rough);
    let g = model.parameters[GRAVITY].nominal.max(0.1);
    // A model that declares no restitution is one of flight.
    let bounces = model.declared.iter().any(|p| p == "restitution");
    data.records.iter_mut().for_each(|r| segment(r, vertical, g, sigma, bounces));
    let heights = |r: &Record| r.y[vertical].iter().filter(|y| y.is_finite()).count();
    data.records.retain(|r| heights(r) >= FEWEST && !r.arcs.is_empty());
    let found = data.records.len();
    if found < 2 {
        let data = data.name;
        return Err(DiscoveryError::TooFew { data, found });
    }
    let calibrates = !model.parameters[RESTITUTION].frozen;
    if calibrates && !data.has_impacts() {
        return Err(DiscoveryError::NoImpacts { data: data.name, model: model.file.clone() });
    }
    let mut noise = estimate(&mut data, model.position_sd_m);
    let everything: Vec<usize> = (0..data.records.len()).collect();
    if noise.findings.contains(&"outliers") {
        let sample = Sample { data: &data, chosen: &everything, correlation: noise.correlation };
        let found = spikes(&sample, &calibrate(model, &sample));
        noise.outliers += found.len();
        mask(&mut data, &found);
    }
    let (train, test) = split(&data, &everything, options);
    Ok(Prepared { data, noise, train, test })
}

/// Deals the trajectories `among` out to training and test.
pub(crate) fn split(data: &Measured, among: &[usize], options: &Options) -> (Vec<usize>, Vec<usize>) {
    // Few trajectories: the half that is held out says more than three or four would.
    let few = (1.0 - options.train_share) * (among.len() as f64) < FEWEST_HELD_OUT;
    let share = if few { options.train_share.min(0.5) } else { options.train_share };
    deal::split(&data.group_of(), among, share, options.seed)
}
