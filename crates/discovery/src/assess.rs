//! The gain of a named set of effects: an oracle that knows what to look for.

use crate::addition::Addition;
use crate::calibrate::calibrate;
use crate::candidates::Family;
use crate::prepare::prepare;
use crate::search::Search;
use crate::{DiscoveryError, Options, forecast};
use augsim_data::Dataset;
use augsim_physics::system::{Declaration, ScatterPer, System};

/// A set of effects compared with the calibrated model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assessment {
    /// Gain in -2 ln likelihood on the training trajectories.
    pub gain: f64,
    /// The penalty of the set.
    pub penalty: f64,
    /// Forecast error on held-out records with the set, in the unit of their channels.
    pub rmse: f64,
}

impl Assessment {
    /// Whether the data show the set at all.
    pub fn visible(&self) -> bool {
        self.gain > self.penalty
    }
}

/// Fits the calibrated model with the effects `kinds` (unknown kinds are left out; scatter as `per`) from their typical
/// sizes, with both signs for those that have one.
///
/// # Errors
/// The errors of [`discover`](crate::discover).
pub fn assess(
    model: &dyn Declaration,
    data: &Dataset,
    kinds: &[&str],
    per: ScatterPer,
    options: &Options,
) -> Result<Assessment, DiscoveryError> {
    let prepared = prepare(model, data, options)?;
    let [train, test] = [&prepared.train, &prepared.test].map(|chosen| prepared.sample(chosen));
    let search = Search::new(train, test, Family::Described, options);
    let base = calibrate(&search.train);
    let system: &dyn System = &*prepared.data.system;
    let additions: Vec<Addition> = kinds
        .iter()
        .filter_map(|kind| {
            let scatter = Addition::scatter(system, per).filter(|scatter| scatter.kind() == *kind);
            scatter.or_else(|| Addition::of_kind(system, kind))
        })
        .collect();
    let signs = 1usize << additions.len();
    let fits = (0..signs).map(|bits| {
        let starts: Vec<(Addition, Vec<f64>)> = additions
            .iter()
            .enumerate()
            .filter_map(|(i, a)| {
                let p = a.parameters().first()?;
                let sign = if bits >> i & 1 == 1 && p.min < 0.0 { -1.0 } else { 1.0 };
                Some((a.clone(), vec![0.5 * sign * p.typical]))
            })
            .collect();
        search.refit(&base, &additions, &starts)
    });
    let mut best: Option<crate::search::Judged> = None;
    for j in fits {
        if best.as_ref().is_none_or(|b| j.criterion < b.criterion) {
            best = Some(j);
        }
    }
    let best = best.unwrap_or_else(|| search.judge(base.clone()));
    Ok(Assessment {
        gain: 2.0 * (best.fit.ll - base.ll),
        penalty: search.penalty_of(best.additions()),
        rmse: forecast::rmse(&forecast::errors(&search.test, &best.fit, &best.fit.theta)),
    })
}
