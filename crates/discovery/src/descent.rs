//! Minimisation of the cost over theta by damped Gauss-Newton steps, with its stopping rules.

use crate::evaluate::Lanes;
use crate::fit_state::State;
use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::record::ChosenRecords;
use crate::theta_step::{Step, curvature, shorter_step, theta_step};

/// Maximum number of simulations of all records in one minimisation of the cost. Fits of adequate models take
/// 4 to 15; longer ones follow valleys that are flat to the required precision.
const MAX_SIMULATIONS: usize = 60;
/// [`MAX_SIMULATIONS`] for systems with idealised laws, whose simulations are expensive.
const MAX_SIMULATIONS_IDEALISED: usize = 25;
/// Decrease of the cost in one step below which the step counts as small: absolute part, and share of the
/// cost.
const SMALL_DECREASE: (f64, f64) = (1e-3, 1e-6);
/// [`SMALL_DECREASE`] for systems with idealised laws: decreases below a hundredth of a standard deviation
/// per sample do not matter.
const SMALL_DECREASE_IDEALISED: (f64, f64) = (0.05, 1e-5);

/// Number of trial steps over which a stalled fit decreases the cost by less than [`STALL_DECREASE`].
const STALL_TRIALS: usize = 9;
/// Decrease of the cost over [`STALL_TRIALS`] trial steps below which a fit is stalled. It is the sum of an
/// absolute part, too small for any decision, and a share of the cost.
const STALL_DECREASE: (f64, f64) = (0.5, 2e-5);

/// Maximum number of trial steps from one point before the minimisation ends.
const MAX_TRIALS: usize = 8;
/// Levenberg-Marquardt damping at the start of a minimisation.
const INITIAL_DAMPING: f64 = 1e-3;
/// Minimum of the damping; a smaller one does not change a step.
const MIN_DAMPING: f64 = 1e-9;
/// Factor by which the damping grows after a rejected step and falls after good steps.
const DAMPING_FACTOR: f64 = 8.0;
/// Factor by which the damping grows after an accepted step that was too long.
const LONG_STEP_FACTOR: f64 = 4.0;
/// Ratio of actual to predicted decrease of the cost below which a step was too long.
const LONG_STEP_RATIO: f64 = 0.25;
/// Ratio of actual to predicted decrease of the cost above which a step is good.
const GOOD_STEP_RATIO: f64 = 0.75;
/// Maximum number of successive good steps before the damping is lowered to try a longer step.
const MAX_PATIENCE: usize = 8;

/// Whether a fit has stalled, given its best cost after each trial step. A fit that found no finite cost has.
fn is_stalled(costs: &[f64]) -> bool {
    let Some(earlier) = costs.len().checked_sub(STALL_TRIALS) else { return false };
    let now = costs[costs.len() - 1];
    !now.is_finite() || costs[earlier] - now < STALL_DECREASE.0 + STALL_DECREASE.1 * now.abs()
}

/// Whether a fit cannot reach the cost `target` in `trials` further trial steps, even if it keeps the pace of its last
/// [`STALL_TRIALS`] ones.
///
/// Fits mostly become slower as they converge, but after a curved valley one can become faster again. So this ends only fits
/// from further starts, of sets that have a fit already.
fn is_out_of_reach(costs: &[f64], target: f64, trials: usize) -> bool {
    let Some(earlier) = costs.len().checked_sub(STALL_TRIALS) else { return false };
    let now = costs[costs.len() - 1];
    let pace = (costs[earlier] - now) / (STALL_TRIALS - 1) as f64;
    now - pace * trials as f64 > target
}

/// Damping of the steps of a minimisation, adapted to their success.
///
/// Good steps are followed by a longer one. Each time that one is rejected, the number of good steps required
/// before the next attempt doubles, because along a curved valley every longer step fails and costs as much as a
/// good one.
#[derive(Debug)]
struct Damping {
    value: f64,
    patience: usize,
    good_steps: usize,
    is_trying_longer: bool,
}

impl Damping {
    fn new() -> Self {
        Self { value: INITIAL_DAMPING, patience: 1, good_steps: 0, is_trying_longer: false }
    }

    /// Decreases the damping, so that the next step is longer.
    fn decrease(&mut self) {
        self.value = (self.value / DAMPING_FACTOR).max(MIN_DAMPING);
    }

    /// Adapts the damping after an accepted step. `share` is its ratio of actual to predicted decrease;
    /// `was_shortened` says whether longer steps had been rejected.
    fn record_accepted(&mut self, share: f64, was_shortened: bool) {
        self.good_steps = if was_shortened || share < GOOD_STEP_RATIO { 0 } else { self.good_steps + 1 };
        self.is_trying_longer = self.good_steps >= self.patience;
        if self.is_trying_longer {
            self.decrease();
        } else if share < LONG_STEP_RATIO {
            self.value *= LONG_STEP_FACTOR;
        }
    }

    /// Adapts the damping after a rejected step.
    fn record_rejected(&mut self) {
        if self.is_trying_longer {
            self.patience = (2 * self.patience).min(MAX_PATIENCE);
            self.is_trying_longer = false;
        }
        self.value *= DAMPING_FACTOR;
    }
}

/// A minimisation of the cost.
pub(crate) struct Descent {
    /// Whether theta (the shared parameters) changes, or only the nuisances (initial state, record parameters, event
    /// offsets).
    pub moves_theta: bool,
    /// Number of simulations of all records so far.
    pub work: usize,
    /// Cost that a result must be below to be of use. The minimisation ends where it cannot be reached.
    pub target: f64,
    /// Whether the minimisation ended because its target cannot be reached.
    pub is_given_up: bool,
}

impl Descent {
    pub fn new(moves_theta: bool, target: f64) -> Self {
        Self { moves_theta, work: 0, target, is_given_up: false }
    }

    /// Minimises the cost from `state` and returns the best state; further calls continue with the remaining
    /// simulations.
    ///
    /// Systems with rough initial states (equations) start far from the minimum and, with missing effects,
    /// follow curved valleys: their damping adapts to the ratio of actual to predicted decrease, and stalled
    /// fits are aborted. Other systems start near the minimum and need few steps.
    pub fn minimise(
        &mut self,
        sample: &ChosenRecords<'_>,
        h: &Hypothesis,
        lanes: &[Lanes],
        mut state: State,
    ) -> State {
        let bounds = h.fit_bounds();
        let (max_work, (absolute, relative)) = match sample.data.is_idealised() {
            true => (MAX_SIMULATIONS_IDEALISED, SMALL_DECREASE_IDEALISED),
            false => (MAX_SIMULATIONS, SMALL_DECREASE),
        };
        let has_rough_starts = h.system.starts_from_first_samples();
        let moves_theta = self.moves_theta;
        let is_aborted = |costs: &[f64]| has_rough_starts && moves_theta && is_stalled(costs);
        let (mut damping, mut small_steps, mut costs) = (Damping::new(), 0, vec![state.q]);
        while self.work < max_work && !is_aborted(&costs) && !sample.data.clock.is_over() {
            if moves_theta && is_out_of_reach(&costs, self.target, max_work - self.work) {
                self.is_given_up = true;
                break;
            }
            let mut is_accepted = false;
            let mut rejected: Option<Step> = None;
            let plain = match moves_theta {
                true => curvature(h, lanes, &state.normals, 0.0).0,
                false => Square::zero(0),
            };
            for _ in 0..MAX_TRIALS {
                if sample.data.clock.is_over() {
                    break;
                }
                let step = match &rejected {
                    _ if !moves_theta => Step::none(&state.theta),
                    Some(rejected) if has_rough_starts => {
                        let (step, value) =
                            shorter_step(h, lanes, &state, &plain, damping.value, &bounds, rejected);
                        damping.value = value;
                        step
                    }
                    _ => theta_step(h, lanes, &state, &plain, damping.value, &bounds),
                };
                let trial = state.after_step(sample, h, lanes, &step.change, damping.value);
                self.work += 1;
                costs.push(trial.q.min(state.q));
                if trial.q <= state.q {
                    let decrease = state.q - trial.q;
                    let share =
                        if step.predicted_decrease > 0.0 { decrease / step.predicted_decrease } else { 1.0 };
                    match has_rough_starts {
                        true => damping.record_accepted(share, rejected.is_some()),
                        false => damping.decrease(),
                    }
                    state = trial;
                    is_accepted = true;
                    let is_small = decrease < absolute + relative * state.q;
                    small_steps = if is_small { small_steps + 1 } else { 0 };
                    break;
                }
                damping.record_rejected();
                rejected = Some(step);
            }
            if !is_accepted || (small_steps > 0 && damping.value < 1e-4) || small_steps >= 3 {
                break;
            }
        }
        state
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a fit is aborted only when stalled; longer steps are tried ever more rarely while they
    //! fail.
    use super::*;

    #[test]
    fn a_decrease_of_a_twentieth_per_trial_is_a_stall() {
        let falling = |by: f64| -> Vec<f64> { (0..20).map(|k| 1000.0 - by * f64::from(k)).collect() };
        assert!(is_stalled(&falling(0.05)) && !is_stalled(&falling(0.2)));
        assert!(!is_stalled(&falling(0.05)[..5]), "too few trials");
        assert!(is_stalled(&[f64::INFINITY; STALL_TRIALS]), "no finite cost");
    }

    #[test]
    fn a_target_is_out_of_reach_if_the_present_pace_does_not_lead_to_it() {
        let costs: Vec<f64> = (0..STALL_TRIALS).map(|k| 1000.0 - 2.0 * k as f64).collect();
        let end = 1000.0 - 2.0 * (STALL_TRIALS - 1) as f64;
        assert!(is_out_of_reach(&costs, end - 41.0, 20) && !is_out_of_reach(&costs, end - 39.0, 20));
        assert!(!is_out_of_reach(&costs, f64::INFINITY, 20), "any cost is of use");
        assert!(!is_out_of_reach(&costs[1..], 0.0, 1), "too few trials");
    }

    #[test]
    fn failing_longer_steps_are_tried_more_and_more_rarely() {
        let mut damping = Damping::new();
        let mut waited = Vec::new();
        for _ in 0..5 {
            let mut good = 0;
            while !damping.is_trying_longer {
                damping.record_accepted(1.0, false);
                good += 1;
            }
            waited.push(good);
            let before = damping.value;
            damping.record_rejected();
            damping.record_accepted(1.0, true);
            assert_eq!(damping.value, DAMPING_FACTOR * before);
        }
        assert_eq!(waited, [1, 2, 4, 8, 8]);
    }
}
