//! The way from a start to the least cost: damped steps, and when to leave off.

use crate::chosen_records::ChosenRecords;
use crate::evaluate::Lanes;
use crate::hypothesis::Hypothesis;
use crate::linear::Square;
use crate::state::State;
use crate::theta_step::{Step, curvature, shorter_step, theta_step};

/// Most simulations of the whole sample in one minimisation. Fits of true models take 4 to 15; what takes longer crawls along
/// a valley whose floor is flat to the precision that matters.
const MOST_ASSEMBLIES: usize = 60;
/// The same where laws are idealisations, whose simulations are dear.
const MOST_IDEALISED: usize = 25;
/// Decrease of the cost that is small, absolute and relative.
const SMALL: (f64, f64) = (1e-3, 1e-6);
/// The same where laws are idealisations: gains of less than a hundredth of a standard deviation a sample are none.
const SMALL_IDEALISED: (f64, f64) = (0.05, 1e-5);

/// Trials over which a fit crawls that lowers the cost, in all of them, by crumbs.
const CRAWL: usize = 9;
/// A fall of the cost that is but crumbs: an absolute part, which no decision notices, and a share of the cost, which is a sum of
/// logarithms of misfits.
const CRUMBS: (f64, f64) = (0.5, 2e-5);

/// Most steps that are tried from one place.
const MOST_TRIALS: usize = 8;
/// Damping that a descent begins with.
const FIRST_DAMPING: f64 = 1e-3;
/// The least damping: less changes no step.
const LEAST_DAMPING: f64 = 1e-9;
/// Factor of the damping after a step that failed; that after good ones is its inverse.
const FACTOR: f64 = 8.0;
/// Factor of the damping after a step that was taken and was too long.
const CAREFUL: f64 = 4.0;
/// Share of the promised decrease below which a step was too long.
const BAD: f64 = 0.25;
/// Share of the promised decrease from which on a step was good.
const GOOD: f64 = 0.75;
/// Most good steps before a longer one is tried.
const MOST_PATIENCE: usize = 8;

/// Whether costs, trial by trial, have stopped falling, but for crumbs.
fn crawls(costs: &[f64]) -> bool {
    let Some(before) = costs.len().checked_sub(CRAWL) else { return false };
    let now = costs[costs.len() - 1];
    costs[before] - now < CRUMBS.0 + CRUMBS.1 * now.abs()
}

/// Damping of the steps of a descent. Good steps are followed by a longer one; each time that one fails, which costs as much as a
/// good step, twice as many good ones are waited for: along a curved valley every step that is longer fails.
#[derive(Debug)]
struct Damping {
    value: f64,
    patience: usize,
    good_steps: usize,
    is_longer: bool,
}

impl Damping {
    fn new() -> Self {
        Self { value: FIRST_DAMPING, patience: 1, good_steps: 0, is_longer: false }
    }

    /// Takes note of a step that was taken: the next may be longer.
    fn eased(&mut self) {
        self.value = (self.value / FACTOR).max(LEAST_DAMPING);
    }

    /// Takes note of a step that was taken, which brought this share of its promise, and whether longer ones had failed before it.
    fn taken(&mut self, share: f64, was_shortened: bool) {
        self.good_steps = if was_shortened || share < GOOD { 0 } else { self.good_steps + 1 };
        self.is_longer = self.good_steps >= self.patience;
        if self.is_longer {
            self.eased();
        } else if share < BAD {
            self.value *= CAREFUL;
        }
    }

    /// Takes note of a step that failed.
    fn refused(&mut self) {
        if self.is_longer {
            self.patience = (2 * self.patience).min(MOST_PATIENCE);
            self.is_longer = false;
        }
        self.value *= FACTOR;
    }
}

/// A minimisation: whether theta moves in it, and how many simulations of the whole sample it has used.
pub(crate) struct Descent {
    pub moves_theta: bool,
    pub work: usize,
}

impl Descent {
    pub fn new(moves_theta: bool) -> Self {
        Self { moves_theta, work: 0 }
    }

    /// The state of the least cost that steps from `state` come to. Further calls go on with the work that is left.
    ///
    /// Where starts are guessed from first samples, as those of equations are, laws that are missing leave misfits of many times the
    /// noise, and fits go far along curved valleys: steps are weighed by what they promised, and fits are left off. Fits of models
    /// whose misfit is near the noise take few steps, each as long as will do.
    pub fn minimise(
        &mut self,
        sample: &ChosenRecords<'_>,
        h: &Hypothesis,
        lanes: &[Lanes],
        mut state: State,
    ) -> State {
        let bounds = h.bounds();
        let (most, (absolute, relative)) = match sample.data.is_idealised() {
            true => (MOST_IDEALISED, SMALL_IDEALISED),
            false => (MOST_ASSEMBLIES, SMALL),
        };
        let goes_far = h.system.begins_from_first_samples();
        let moves_theta = self.moves_theta;
        let is_left_off = |costs: &[f64]| goes_far && moves_theta && crawls(costs);
        let (mut damping, mut small_steps, mut costs) = (Damping::new(), 0, vec![state.q]);
        while self.work < most && !is_left_off(&costs) {
            let mut is_taken = false;
            let mut failed: Option<Step> = None;
            let plain = match moves_theta {
                true => curvature(h, lanes, &state.normals, 0.0).0,
                false => Square::zero(0),
            };
            for _ in 0..MOST_TRIALS {
                let step = match &failed {
                    _ if !moves_theta => Step::none(&state.theta),
                    Some(failed) if goes_far => {
                        let (step, value) =
                            shorter_step(h, lanes, &state, &plain, damping.value, &bounds, failed);
                        damping.value = value;
                        step
                    }
                    _ => theta_step(h, lanes, &state, &plain, damping.value, &bounds),
                };
                let trial = state.advanced(sample, h, lanes, &step.change, damping.value);
                self.work += 1;
                costs.push(trial.q.min(state.q));
                if trial.q <= state.q {
                    let decrease = state.q - trial.q;
                    let share = if step.promise > 0.0 { decrease / step.promise } else { 1.0 };
                    match goes_far {
                        true => damping.taken(share, failed.is_some()),
                        false => damping.eased(),
                    }
                    state = trial;
                    is_taken = true;
                    let is_small = decrease < absolute + relative * state.q;
                    small_steps = if is_small { small_steps + 1 } else { 0 };
                    break;
                }
                damping.refused();
                failed = Some(step);
            }
            if !is_taken || (small_steps > 0 && damping.value < 1e-4) || small_steps >= 3 {
                break;
            }
        }
        state
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a fit is left off only where it crawls; longer steps are tried ever more rarely where they fail.
    use super::*;

    #[test]
    fn crumbs_are_not_picked_up() {
        let falling = |by: f64| -> Vec<f64> { (0..20).map(|k| 1000.0 - by * f64::from(k)).collect() };
        assert!(crawls(&falling(0.05)) && !crawls(&falling(0.2)));
        assert!(!crawls(&falling(0.05)[..5]), "too early to tell");
    }

    #[test]
    fn longer_steps_that_fail_are_tried_more_and_more_rarely() {
        let mut damping = Damping::new();
        let mut waited = Vec::new();
        for _ in 0..5 {
            let mut good = 0;
            while !damping.is_longer {
                damping.taken(1.0, false);
                good += 1;
            }
            waited.push(good);
            let before = damping.value;
            damping.refused();
            damping.taken(1.0, true);
            assert_eq!(damping.value, FACTOR * before);
        }
        assert_eq!(waited, [1, 2, 4, 8, 8]);
    }
}
