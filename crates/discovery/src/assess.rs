//! The gain of a named set of effects: an oracle that knows what to look for.

use crate::addition::Addition;
use crate::calibrate::calibrate;
use crate::candidates::Family;
use crate::fit::Fit;
use crate::judged::Judged;
use crate::prepare::prepare;
use crate::scattered::promise;
use crate::score::scores;
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
    let search = Search::on(&prepared, Family::Described);
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
    let mut best: Option<Judged> = None;
    for j in fits.chain(scored(&search, &base, &additions)) {
        if best.as_ref().is_none_or(|b| j.criterion < b.criterion) {
            best = Some(j);
        }
    }
    let best = best.unwrap_or_else(|| search.judge(base.clone()));
    let drawn = system.schema().drawn.as_ref().is_some_and(|d| kinds.contains(&d.scatter.kind.as_str()));
    let own = if drawn { promise(&search, &best).unwrap_or([0.0, f64::INFINITY]) } else { [0.0; 2] };
    Ok(Assessment {
        gain: 2.0 * (best.fit.ll - base.ll) + own[0],
        penalty: best.penalty + own[1],
        rmse: forecast::first_rmse(&search.test, &best.fit),
    })
}

/// The set built up one by one, each addition from where its test puts it.
fn scored(search: &Search<'_>, base: &Fit, additions: &[Addition]) -> Option<Judged> {
    let mut now: Option<Judged> = None;
    for (count, addition) in additions.iter().enumerate() {
        let from = now.as_ref().map_or(base, |j| &j.fit);
        let score = scores(&search.train, from, std::slice::from_ref(addition)).into_iter().next()?;
        now = Some(search.refit(from, &additions[..=count], &[(addition.clone(), score.estimate)]));
    }
    now
}
