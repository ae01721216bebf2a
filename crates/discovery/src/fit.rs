//! The estimator of all fits: Levenberg-Marquardt on theta, with the nuisances of each window eliminated.

use crate::descent::Descent;
use crate::evaluate::{Lanes, NormalEquations};
use crate::event_offsets::{Spread, offset_spread, scatter_bounds};
use crate::fit_state::State;
pub(crate) use crate::fit_state::assemble_all;
use crate::growing_windows::fit_growing;
use crate::hypothesis::Hypothesis;
use crate::linear::{Square, eliminate};
use crate::nuisance_fit::{WindowState, fit_nuisances_from};
pub(crate) use crate::record::ChosenRecords;
use crate::record::RecordWindow;
use augsim_system::{Event, Scatter};
use std::collections::BTreeMap;

/// Robust weight of a window at or below which its initial state may be wrong.
const LOST_WEIGHT: f64 = 0.2;

/// Maximum number of updates of the standard deviation of the events' random effect in one fit.
const MAX_SCATTER_STEPS: usize = 12;
/// Change of the logarithm of the random effect's standard deviation below which its updates have converged.
const SCATTER_TOLERANCE: f64 = 0.01;

/// A hypothesis (model with a set of effects) with its fitted parameters, cost and information.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub hypothesis: Hypothesis,
    pub theta: Vec<f64>,
    /// Initial state, record parameters and event offsets (together the nuisances) of each window of the
    /// chosen records.
    pub nuisance: Vec<Vec<f64>>,
    /// Minimised robust cost, minus twice a log density.
    pub cost: f64,
    /// Log likelihood, up to a constant that is common to all hypotheses on the same records.
    pub ll: f64,
    /// Information matrix of theta (the shared parameters), with the nuisances (initial state, record
    /// parameters, event offsets) eliminated.
    pub information: Square,
    /// For each window: squared norm of the residuals, in units of the noise, and their degrees of freedom.
    pub residual_norms: Vec<[f64; 2]>,
    /// Standard deviation of the event offsets, deviations of the events' parameter from its common value.
    pub spread: Spread,
    /// Simulated events in each window of the chosen records.
    pub events: Vec<Vec<Event>>,
}

/// Joins the fitted nuisances (initial state, record parameters, event offsets) of several samples of
/// records, in the order of the records in the data.
pub(crate) fn merge_nuisances(parts: &[(&ChosenRecords<'_>, &Fit)]) -> Vec<Vec<f64>> {
    let mut by_record: BTreeMap<usize, &[Vec<f64>]> = BTreeMap::new();
    for (sample, fit) in parts {
        let windows = sample.windows_by_record().into_iter().map(|range| &fit.nuisance[range]);
        by_record.extend(sample.chosen.iter().copied().zip(windows));
    }
    by_record.into_values().flatten().cloned().collect()
}

/// Computes the information matrix of theta (the shared parameters), with the nuisances (initial state,
/// record parameters, event offsets) eliminated.
fn information(h: &Hypothesis, lanes: &[Lanes], normals: &[NormalEquations]) -> Square {
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

/// Fits a hypothesis from the shared parameters `theta` and the initial states and event offsets in
/// `nuisance`. If `nuisance` is empty, the fit starts from the rough initial states.
pub(crate) fn fit(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Fit {
    fit_below(sample, hypothesis, theta, nuisance, f64::INFINITY)
}

/// As [`fit`], but ends early where the fit cannot reach a cost below `target`. With a random effect every fit is
/// completed, because its cost changes with the standard deviation of the random effect.
pub(crate) fn fit_below(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
    target: f64,
) -> Fit {
    let target = if hypothesis.scatter.is_some() { f64::INFINITY } else { target };
    fit_with(sample, hypothesis, theta, nuisance, true, target)
}

/// Fits the nuisances (initial states, record parameters, event offsets) at fixed shared parameters and
/// random effects.
pub(crate) fn fit_nuisance(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Fit {
    fit_with(sample, hypothesis, theta, nuisance, false, f64::INFINITY)
}

/// Initial nuisances of windows: those in `known`, and rough initial states for the windows beyond it.
fn initial_nuisances(
    h: &Hypothesis,
    lanes: &[Lanes],
    windows: &[RecordWindow<'_>],
    known: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let initial = |(i, (lanes, &window)): (usize, (&Lanes, &RecordWindow<'_>))| match known.get(i) {
        Some(known) => {
            let mut nuisance = known.clone();
            let declared = lanes.starts() - lanes.effect_starts();
            if lanes.effect_starts() > 0 && known.len() == declared {
                // A fit without the effects does not have the initial values of their states.
                nuisance.extend(lanes.initial_nuisance(h, window).into_iter().skip(declared));
            }
            // Nuisances of another hypothesis may have more or fewer offsets.
            nuisance.resize(lanes.nuisances(), 0.0);
            nuisance
        }
        None => lanes.initial_nuisance(h, window),
    };
    lanes.iter().zip(windows).enumerate().map(initial).collect()
}

fn fit_with(
    sample: &ChosenRecords<'_>,
    hypothesis: &Hypothesis,
    theta: &[f64],
    nuisance: &[Vec<f64>],
    move_theta: bool,
    target: f64,
) -> Fit {
    sample.data.work.count_fit();
    let mut h = hypothesis.clone();
    let windows = sample.windows();
    let lanes: Vec<Lanes> = windows.iter().map(|&at| Lanes::new(&h, at, &[])).collect();
    let is_fresh = nuisance.is_empty();
    let nuisance = initial_nuisances(&h, &lanes, &windows, nuisance);
    let mut state = State::evaluate(sample, &h, &lanes, theta.to_vec(), nuisance);
    // Rough initial states may all be wrong. Fitted ones are compared with the usual weight instead: with
    // missing effects every window fits badly, and restarting all of them would be most of the work.
    let is_relative = !is_fresh && h.system.starts_from_first_samples();
    let lost_weight =
        |state: &State| if is_relative { LOST_WEIGHT * usual_weight(&state.normals) } else { LOST_WEIGHT };
    let max_weight = lost_weight(&state);
    state = restart_lost_windows(sample, &h, &lanes, state, max_weight);
    let mut changes: Vec<f64> = Vec::new();
    for _ in 0..MAX_SCATTER_STEPS {
        let mut descent = Descent::new(move_theta, target);
        state = descent.minimise(sample, &h, &lanes, state);
        if descent.is_given_up {
            break;
        }
        if h.system.starts_from_first_samples() {
            // With the improved parameters a restart may recover windows that were lost before.
            let cost_before = state.q;
            let max_weight = lost_weight(&state);
            state = restart_lost_windows(sample, &h, &lanes, state, max_weight);
            if state.q < cost_before {
                state = descent.minimise(sample, &h, &lanes, state);
            }
        }
        let Some(scatter) = h.scatter.filter(|_| move_theta) else {
            break;
        };
        let spread = offset_spread(&h, &lanes, &state.normals, &state.nuisance, scatter.sd);
        let change = (spread.sd / scatter.sd).ln();
        changes.push(change);
        let (least, most) = scatter_bounds(&h);
        let sd = (scatter.sd.ln() + aitken_step(&changes)).exp().clamp(least, most);
        h.scatter = Some(Scatter { sd, ..scatter });
        let State { theta, nuisance, .. } = state;
        state = State::evaluate(sample, &h, &lanes, theta, nuisance);
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
    let spread_at = |s: Scatter| offset_spread(&h, &lanes, &state.normals, &state.nuisance, s.sd);
    let spread = h.scatter.map(spread_at).unwrap_or_default();
    Fit {
        hypothesis: h,
        spread,
        theta: state.theta,
        nuisance: state.nuisance,
        cost: state.q,
        ll,
        information,
        residual_norms: state
            .normals
            .iter()
            .map(|n| [n.residual_norm_squared, n.degrees_of_freedom])
            .collect(),
        events: state.normals.into_iter().map(|n| n.events).collect(),
    }
}

/// Next change of ln sd of the events' random effect, from the history of its fixed-point steps. The
/// fixed-point iteration converges linearly, and slowly where the data hardly determine the offsets: Aitken's
/// extrapolation from the last two steps accelerates it.
fn aitken_step(changes: &[f64]) -> f64 {
    match changes {
        [.., previous, last] => {
            let ratio = last / previous;
            if (0.1..0.9).contains(&ratio) { last / (1.0 - ratio) } else { *last }
        }
        _ => changes.last().copied().unwrap_or(0.0),
    }
}

/// Robust weight that a quarter of the windows exceed, at most 1. With a missing effect all windows fit
/// badly, which does not mean that their initial states are wrong.
fn usual_weight(normals: &[NormalEquations]) -> f64 {
    let mut weights: Vec<f64> = normals.iter().map(|n| n.weight).collect();
    weights.sort_by(f64::total_cmp);
    weights.get(weights.len() * 3 / 4).map_or(1.0, |weight| weight.min(1.0))
}

/// Refits the nuisances of windows with a robust weight of at most `max_weight` from their rough initial
/// states. Where these come from the first samples alone, fits over growing beginnings of the windows are
/// tried next. Each window keeps its best result.
fn restart_lost_windows(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    lanes: &[Lanes],
    state: State,
    max_weight: f64,
) -> State {
    let State { theta, nuisance, normals, .. } = state;
    let all_windows = sample.windows();
    let mut best: Vec<WindowState> = normals.into_iter().zip(nuisance).collect();
    let methods: &[bool] = if h.system.starts_from_first_samples() { &[false, true] } else { &[false] };
    for is_growing in methods {
        let is_lost = |w: &usize| {
            let weight = best[*w].0.weight;
            lanes[*w].nuisances() > 0 && (weight <= max_weight || weight.is_nan())
        };
        let lost: Vec<usize> = (0..best.len()).filter(is_lost).collect();
        let windows: Vec<RecordWindow<'_>> = lost.iter().map(|w| all_windows[*w]).collect();
        let lanes: Vec<Lanes> = lost.iter().map(|w| lanes[*w].clone()).collect();
        let rough: Vec<Vec<f64>> =
            windows.iter().zip(&lanes).map(|(at, l)| l.initial_nuisance(h, *at)).collect();
        let restarted = match is_growing {
            false => fit_nuisances_from(sample, h, &theta, &windows, &lanes, rough),
            true => fit_growing(sample, h, &theta, &windows, &lanes, rough),
        };
        for (w, fresh) in lost.into_iter().zip(restarted) {
            if fresh.0.q < best[w].0.q {
                best[w] = fresh;
            }
        }
    }
    let q = best.iter().map(|(n, _)| n.q).sum();
    let (normals, nuisance) = best.into_iter().unzip();
    State { theta, nuisance, normals, q }
}
