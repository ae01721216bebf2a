//! The gain of a named set of effects: the answer of someone who is told what to look for.

use crate::addition::Addition;
use crate::columns::Family;
use crate::prepare::prepare;
use crate::scattered;
use crate::search::{Search, Starts, calibrated};
use crate::{DiscoveryError, Options, forecast};
use augsim_data::Dataset;
use augsim_physics::system::{Declaration, ScatterPer, System};

/// A set of effects compared with the calibrated model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assessment {
    /// Gain of predictions of left-out blocks, in nats.
    pub gain: f64,
    /// The price of the set, in nats.
    pub penalty: f64,
    /// Forecast error on the records that are kept out, on all where none are, in the unit of their channels.
    pub rmse: f64,
}

impl Assessment {
    /// Whether the data show the set at all.
    pub fn visible(&self) -> bool {
        self.gain > self.penalty
    }
}

/// Fits the calibrated model with the effects `kinds` (unknown kinds are left out; scatter as `per`) from their typical sizes, with both
/// signs for those that have one.
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
    let (view, base) = calibrated(&prepared, &prepared.searched);
    let search = Search::new(&view, &[Family::Described], &prepared.clock);
    let system: &dyn System = &*prepared.data.system;
    let additions: Vec<Addition> = kinds
        .iter()
        .filter_map(|kind| {
            let scatter = Addition::scatter(system, per).filter(|scatter| scatter.kind() == *kind);
            scatter.or_else(|| Addition::of_kind(system, kind))
        })
        .collect();
    let fits = (0..1usize << additions.len()).map(|bits| {
        let start = |(i, a): (usize, &Addition)| {
            let p = a.parameters().first()?;
            let sign = if bits >> i & 1 == 1 && p.min < 0.0 { -1.0 } else { 1.0 };
            let rest = a.parameters().iter().skip(1).map(|p| p.typical);
            Some((a.clone(), std::iter::once(0.5 * sign * p.typical).chain(rest).collect()))
        };
        let starts: Starts = additions.iter().enumerate().filter_map(start).collect();
        search.refit(&base.fit, &additions, &starts)
    });
    let best = fits
        .filter(|s| s.is_finite())
        .min_by(|a, b| a.evidence.cost().total_cmp(&b.evidence.cost()))
        .unwrap_or_else(|| base.clone());
    let drawn = system.schema().drawn.as_ref().is_some_and(|d| kinds.contains(&d.scatter.kind.as_str()));
    let own = if drawn { scattered::gain(&search, &best) } else { 0.0 };
    let kept = if prepared.kept_out.is_empty() { &prepared.searched } else { &prepared.kept_out };
    Ok(Assessment {
        gain: best.gain_over(&base, best.evidence.memory.independent) + own,
        penalty: search.price().of_set(&additions) + f64::from(u8::from(drawn)) * search.price().0,
        rmse: forecast::first_rmse(&prepared.sample(kept), &best.fit),
    })
}
