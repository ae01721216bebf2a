//! One estimator for everything: Levenberg-Marquardt with the trajectories' own parameters eliminated.

pub(crate) use crate::chosen_records::ChosenRecords;
use crate::descent::Descent;
use crate::evaluate::{Lanes, Normal};
use crate::follow::{Settled, settled_from};
use crate::grown::grown;
use crate::hypothesis::Hypothesis;
use crate::linear::{Square, eliminate};
use crate::offsets::{Spread, scatter_bounds, spread_of};
use crate::record::Excerpt;
use crate::state::State;
pub(crate) use crate::state::assembled;
use augsim_physics::system::{Event, Scatter};
use std::collections::BTreeMap;

/// Weight below which a record is followed so badly that its start is in doubt.
const LOST: f64 = 0.2;

/// Most steps of the scatter, and the relative step below which it stands still.
const MOST_SCATTER_STEPS: usize = 12;
const SCATTER_TOLERANCE: f64 = 0.01;

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub hypothesis: Hypothesis,
    pub theta: Vec<f64>,
    /// Nuisances of each window of the chosen records.
    pub nuisance: Vec<Vec<f64>>,
    /// The cost that was minimised.
    pub cost: f64,
    /// Ln likelihood, the same constant left out for all hypotheses on the same sample.
    pub ll: f64,
    /// Information matrix of theta, nuisances eliminated.
    pub information: Square,
    /// Sum of squared residuals of each window, in units of the noise, and its degrees of freedom.
    pub misfits: Vec<[f64; 2]>,
    /// Spread of the offsets of the events' parameter.
    pub spread: Spread,
    /// Simulated events of each window of the chosen records.
    pub events: Vec<Vec<Event>>,
}

/// Nuisances of the windows of several samples, in the order of all their records.
pub(crate) fn merged(parts: &[(&ChosenRecords<'_>, &Fit)]) -> Vec<Vec<f64>> {
    let mut by_record: BTreeMap<usize, &[Vec<f64>]> = BTreeMap::new();
    for (sample, fit) in parts {
        let windows = sample.of_records().into_iter().map(|range| &fit.nuisance[range]);
        by_record.extend(sample.chosen.iter().copied().zip(windows));
    }
    by_record.into_values().flatten().cloned().collect()
}

/// Information matrix of theta, nuisances eliminated.
fn information(h: &Hypothesis, lanes: &[Lanes], normals: &[Normal]) -> Square {
    let mut s = Square::zero(h.theta_len());
    for (l, normal) in lanes.iter().zip(normals) {
        let (sj, _, _) = eliminate(&normal.h, &normal.g, l.common());
        for (a, &ta) in l.theta.iter().enumerate() {
            for (b, &tb) in l.theta.iter().enumerate() {
                *s.at_mut(ta, tb) += sj.at(a, b);
            }
        }
    }
    s
}

/// Fits a hypothesis from a start. `nuisance` may be empty: then it begins at the rough start of each record.
pub(crate) fn fit(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Fit {
    fit_with(sample, hypothesis, theta, nuisance, true)
}

/// Fits the nuisances alone, with theta (and the scatter) fixed.
pub(crate) fn fit_nuisance(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Fit {
    fit_with(sample, hypothesis, theta, nuisance, false)
}

fn fit_with(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
    move_theta: bool,
) -> Fit {
    sample.data.tally.fit();
    let mut h = hypothesis.clone();
    let excerpts = sample.excerpts();
    let lanes: Vec<Lanes> = excerpts.iter().map(|&at| Lanes::new(&h, at, &[])).collect();
    let is_fresh = nuisance.is_empty();
    let nuisance: Vec<Vec<f64>> = lanes
        .iter()
        .zip(&excerpts)
        .enumerate()
        .map(|(i, (l, &at))| match nuisance.get(i) {
            Some(n) => {
                // A start from another hypothesis: offsets may be new or gone.
                let mut n = n.clone();
                n.resize(l.nuisances().max(l.fixed_nuisances()), 0.0);
                n
            }
            None => l.nuisance_start(&h, at),
        })
        .collect();
    let mut state = State::at(sample, &h, &lanes, theta.to_vec(), nuisance);
    // Starts that no fit has found may be in doubt all together. Where a fit has found them, those that are wrong stand out: where a law is
    // missing every window is followed badly, and to begin all of them anew is most of the work.
    let stand_out = !is_fresh && h.system.begins_from_first_samples();
    let lost = |state: &State| if stand_out { LOST * usual_weight(&state.normals) } else { LOST };
    let least = lost(&state);
    state = rescue(sample, &h, &lanes, state, least);
    let mut changes: Vec<f64> = Vec::new();
    for _ in 0..MOST_SCATTER_STEPS {
        let mut descent = Descent::new(move_theta);
        state = descent.minimise(sample, &h, &lanes, state);
        if h.system.begins_from_first_samples() {
            // Parameters that are right now may find windows that were lost to wrong ones.
            let before = state.q;
            let least = lost(&state);
            state = rescue(sample, &h, &lanes, state, least);
            if state.q < before {
                state = descent.minimise(sample, &h, &lanes, state);
            }
        }
        let Some(scatter) = h.scatter.filter(|_| move_theta) else {
            break;
        };
        let spread = spread_of(&h, &lanes, &state.normals, &state.nuisance, scatter.sd);
        let change = (spread.sd / scatter.sd).ln();
        changes.push(change);
        let (least, most) = scatter_bounds(&h);
        let sd = (scatter.sd.ln() + extrapolated(&changes)).exp().clamp(least, most);
        h.scatter = Some(Scatter { sd, ..scatter });
        let State { theta, nuisance, .. } = state;
        state = State::at(sample, &h, &lanes, theta, nuisance);
        if change.abs() < SCATTER_TOLERANCE {
            break;
        }
    }
    let information = information(&h, &lanes, &state.normals);
    let mut ll = -0.5 * state.q;
    for (l, normal) in lanes.iter().zip(&state.normals) {
        let tail: Vec<usize> = (l.common()..normal.h.n).collect();
        ll -= 0.5 * normal.h.sub(&tail).cholesky().log_det;
        ll -= l.offsets as f64 * h.scatter.map_or(0.0, |s| s.sd.ln());
    }
    let spread_at = |s: Scatter| spread_of(&h, &lanes, &state.normals, &state.nuisance, s.sd);
    let spread = h.scatter.map(spread_at).unwrap_or_default();
    Fit {
        hypothesis: h,
        spread,
        theta: state.theta,
        nuisance: state.nuisance,
        cost: state.q,
        ll,
        information,
        misfits: state.normals.iter().map(|n| [n.misfit, n.freedom]).collect(),
        events: state.normals.into_iter().map(|n| n.events).collect(),
    }
}

/// The step of ln sd after a history of fixed-point steps. The fixed point is linear where offsets are hardly seen (and then
/// slow): two steps in a row tell where the sequence goes (Aitken's extrapolation).
fn extrapolated(changes: &[f64]) -> f64 {
    match changes {
        [.., before, now] => {
            let ratio = now / before;
            if (0.1..0.9).contains(&ratio) { now / (1.0 - ratio) } else { *now }
        }
        _ => changes.last().copied().unwrap_or(0.0),
    }
}

/// Weight that a quarter of the windows exceed, at most 1: where a law is missing all of them are followed badly, and no start is in
/// doubt for that.
fn usual_weight(normals: &[Normal]) -> f64 {
    let mut weights: Vec<f64> = normals.iter().map(|n| n.weight).collect();
    weights.sort_by(f64::total_cmp);
    weights.get(weights.len() * 3 / 4).map_or(1.0, |weight| weight.min(1.0))
}

/// Windows whose weight is `least` or less, which are followed badly, begin anew from their rough start; where that comes from
/// their first samples alone and is no better, from one that is found over ever longer beginnings. Each keeps what is best.
fn rescue(sample: &ChosenRecords<'_>, h: &Hypothesis, lanes: &[Lanes], state: State, least: f64) -> State {
    let State { theta, nuisance, normals, .. } = state;
    let all = sample.excerpts();
    let mut best: Vec<Settled> = normals.into_iter().zip(nuisance).collect();
    let ways: &[bool] = if h.system.begins_from_first_samples() { &[false, true] } else { &[false] };
    for is_grown in ways {
        let is_lost = |w: &usize| best[*w].0.weight <= least || best[*w].0.weight.is_nan();
        let lost: Vec<usize> = (0..best.len()).filter(is_lost).collect();
        let windows: Vec<Excerpt<'_>> = lost.iter().map(|w| all[*w]).collect();
        let lanes: Vec<Lanes> = lost.iter().map(|w| lanes[*w].clone()).collect();
        let rough: Vec<Vec<f64>> =
            windows.iter().zip(&lanes).map(|(at, l)| l.nuisance_start(h, *at)).collect();
        let anew = match is_grown {
            false => settled_from(sample, h, &theta, &windows, &lanes, rough),
            true => grown(sample, h, &theta, &windows, &lanes, rough),
        };
        for (w, fresh) in lost.into_iter().zip(anew) {
            if fresh.0.q < best[w].0.q {
                best[w] = fresh;
            }
        }
    }
    let q = best.iter().map(|(n, _)| n.q).sum();
    let (normals, nuisance) = best.into_iter().unzip();
    State { theta, nuisance, normals, q }
}
