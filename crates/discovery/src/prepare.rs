//! From a data set to records with impacts, noise and a split.

use crate::discover::calibrate;
use crate::fit::Sample;
use crate::noise::{Noise, estimate};
use crate::record::Measured;
use crate::segment::{rough_noise, segment};
use crate::spikes::{mask, spikes};
use crate::statistics::median;
use crate::{DiscoveryError, Options};
use augsim_data::{Dataset, random_stream};
use augsim_physics::ball::{GRAVITY, RESTITUTION};
use augsim_physics::model::Model;
use rand::RngExt;

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
/// Fewest samples of a trajectory that is used.
const FEWEST: usize = 8;

pub(crate) fn prepare(
    model: &Model,
    dataset: &Dataset,
    options: &Options,
) -> Result<Prepared, DiscoveryError> {
    let mut data = Measured::from_dataset(dataset, model.clock_reference_s)?;
    let vertical = data.axes.count() - 1;
    let mut rough: Vec<f64> = data.records.iter().map(|r| rough_noise(&r.times, &r.y[vertical])).collect();
    let sigma = median(&mut rough);
    let g = model.parameters[GRAVITY].nominal.max(0.1);
    // A model that declares no restitution is one of flight.
    let bounces = model.declared.iter().any(|p| p == "restitution");
    data.records.iter_mut().for_each(|r| segment(r, vertical, g, sigma, bounces));
    data.records.retain(|r| r.times.len() >= FEWEST && !r.arcs.is_empty());
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

/// The trajectories of each group in random order.
fn shuffled(data: &Measured, among: &[usize], seed: u64, purpose: &str) -> Vec<Vec<usize>> {
    let mut rng = random_stream(seed, purpose, 0);
    (0..data.groups.len())
        .map(|group| {
            let mut members: Vec<usize> =
                among.iter().copied().filter(|&j| data.records[j].group == group).collect();
            for i in (1..members.len()).rev() {
                members.swap(i, rng.random_range(0..=i));
            }
            members
        })
        .collect()
}

/// Deals the trajectories `among` out to training and test group by group, so that every object is seen in training.
pub(crate) fn split(data: &Measured, among: &[usize], options: &Options) -> (Vec<usize>, Vec<usize>) {
    let (mut train, mut test) = (Vec::new(), Vec::new());
    let (mut owed, n) = (0.0, among.len());
    // Few trajectories: the half that is held out says more than three or four would.
    let few = (1.0 - options.train_share) * (n as f64) < FEWEST_HELD_OUT;
    let share = if few { options.train_share.min(0.5) } else { options.train_share };
    for members in shuffled(data, among, options.seed, "discovery split") {
        // Rounding is carried from group to group, so that the whole keeps the share; every group has one in training.
        owed += share * members.len() as f64;
        let most = if data.groups.len() == 1 { members.len() - 1 } else { members.len() };
        let take = (owed.round().max(0.0) as usize).clamp(1.min(most), most);
        owed -= take as f64;
        train.extend(&members[..take]);
        test.extend(&members[take..]);
    }
    if test.is_empty()
        && let Some(last) = train.pop()
    {
        test.push(last);
    }
    train.sort_unstable();
    test.sort_unstable();
    (train, test)
}

/// Deals all trajectories out to folds, group by group. The only trajectory of a group is in none: without it nothing is known
/// of the group.
pub(crate) fn deal(data: &Measured, folds: usize, seed: u64) -> Vec<Vec<usize>> {
    let everything: Vec<usize> = (0..data.records.len()).collect();
    let mut out = vec![Vec::new(); folds];
    let groups = shuffled(data, &everything, seed, "discovery folds");
    let dealt = groups.iter().filter(|members| members.len() > 1).flatten();
    dealt.enumerate().for_each(|(i, &j)| out[i % folds].push(j));
    out.iter_mut().for_each(|fold| fold.sort_unstable());
    out
}
