//! From a data set to records with impacts, noise and a split.

use crate::noise::{Noise, estimate};
use crate::record::Measured;
use crate::segment::{rough_noise, segment};
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

/// Held-out trajectories below which half of all is held out.
const FEWEST_HELD_OUT: f64 = 8.0;
/// Fewest samples of a trajectory that is used.
const FEWEST: usize = 8;

pub(crate) fn prepare(
    model: &Model,
    dataset: &Dataset,
    options: &Options,
) -> Result<Prepared, DiscoveryError> {
    let mut data = Measured::from_dataset(dataset)?;
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
    let noise = estimate(&mut data, model.position_sd_m);
    let (train, test) = split(&data, options);
    Ok(Prepared { data, noise, train, test })
}

/// Deals out trajectories group by group, so that every object is seen in training.
fn split(data: &Measured, options: &Options) -> (Vec<usize>, Vec<usize>) {
    let mut rng = random_stream(options.seed, "discovery split", 0);
    let (mut train, mut test) = (Vec::new(), Vec::new());
    let (mut owed, n) = (0.0, data.records.len());
    // Few trajectories: the half that is held out says more than three or four would.
    let few = (1.0 - options.train_share) * (n as f64) < FEWEST_HELD_OUT;
    let share = if few { options.train_share.min(0.5) } else { options.train_share };
    for group in 0..data.groups.len() {
        let mut members: Vec<usize> = (0..n).filter(|&j| data.records[j].group == group).collect();
        for i in (1..members.len()).rev() {
            members.swap(i, rng.random_range(0..=i));
        }
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
