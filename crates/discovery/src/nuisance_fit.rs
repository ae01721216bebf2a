//! Nuisance fits: for fixed theta, each window minimises its cost over its own nuisances by
//! Levenberg-Marquardt steps.
//!
//! Systems that simulate many windows in one SIMD pass step all unfinished windows together. Where few are
//! left, the idle lanes evaluate the steps that would come next if the present ones fail. The result of a
//! window does not depend on the others.

use crate::evaluate::{Lanes, NormalEquations, Point, assemble_batch, assemble_window};
use crate::hypothesis::Hypothesis;
use crate::record::ChosenRecords;
use crate::record::RecordWindow;
use rayon::prelude::*;

/// Excess of a window's cost over the predicted cost above which a kink of the cost is suspected. A kink
/// arises where the simulation gains or loses an event.
const MAX_EXCESS_COST: f64 = 5.0;
/// Fractions of the step of its nuisances (initial state, record parameters, event offsets) that are tried
/// for a window at a kink of its cost.
const STEP_FRACTIONS: [f64; 2] = [0.2, 0.0];
/// Maximum number of steps in the fit of a window's nuisances (initial state, record parameters, event
/// offsets).
const MAX_NUISANCE_STEPS: usize = 8;
/// Maximum number of nuisance steps of a window that are simulated at once. Each is the one to try if those
/// before it fail.
const MAX_STEPS_AHEAD: usize = 4;
/// Inverse of the share of SIMD lanes up to which a pass costs as much as one window; here 1/4.
const PASS_FRACTION: usize = 4;

/// Normal equations of a window, and the nuisances (initial state, record parameters, event offsets) at which
/// they hold.
pub(crate) type WindowState = (NormalEquations, Vec<f64>);

/// Nuisances of a window after the Gauss-Newton step that follows the step `theta_step` of the shared
/// parameters.
pub(crate) fn nuisance_step(
    l: &Lanes,
    normal: &NormalEquations,
    now: &[f64],
    theta_step: &[f64],
    damping: f64,
) -> Vec<f64> {
    let common = l.common();
    let h = normal.h.damped(damping);
    let tail: Vec<usize> = (common..h.n).collect();
    let mut x: Vec<f64> = tail
        .iter()
        .map(|&i| {
            normal.g[i] - l.theta.iter().enumerate().map(|(a, &t)| h.at(i, a) * theta_step[t]).sum::<f64>()
        })
        .collect();
    h.sub(&tail).cholesky().solve(&mut x);
    now.iter().zip(x).map(|(n, d)| n + d).collect()
}

/// State of the fit of one window's nuisances (initial state, record parameters, event offsets).
pub(crate) struct NuisanceFit<'a> {
    window: RecordWindow<'a>,
    lanes: &'a Lanes,
    best: WindowState,
    /// Cost of the window at or below which the fit stops.
    target_cost: f64,
    stage: Stage<'a>,
}

/// Stage of the fit of a window's nuisances (initial state, record parameters, event offsets).
#[derive(Clone, Copy)]
enum Stage<'a> {
    /// Tries fraction number `n` of the step from these nuisances (initial state, record parameters, event
    /// offsets).
    Shortened(usize, &'a [f64]),
    /// Levenberg-Marquardt steps: damping of the next step, and number of steps done.
    LevenbergMarquardt(f64, usize),
    Done,
}

/// Levenberg-Marquardt damping of the first step in the fit of a window's initial state and event offsets.
const INITIAL_DAMPING: f64 = 1e-6;

impl<'a> NuisanceFit<'a> {
    /// Starts the fit of a window at `trial`, reached by a step from the nuisances `now` (initial state,
    /// record parameters, event offsets) with the predicted cost `cost`. If its cost exceeds `cost` by more
    /// than [`MAX_EXCESS_COST`], its own step is shortened first: one window at a kink (an event more or
    /// less) must not reject the step of all windows. A rise that was predicted, because the step suits other
    /// windows, does not count.
    pub fn after_theta_step(
        window: RecordWindow<'a>,
        lanes: &'a Lanes,
        trial: WindowState,
        now: &'a [f64],
        cost: f64,
    ) -> Self {
        Self { window, lanes, best: trial, target_cost: cost, stage: Stage::Shortened(0, now) }
    }

    /// Starts the fit of a window that minimises its cost from `start`.
    pub fn from_start(window: RecordWindow<'a>, lanes: &'a Lanes, start: WindowState) -> Self {
        Self {
            window,
            lanes,
            best: start,
            target_cost: 0.0,
            stage: Stage::LevenbergMarquardt(INITIAL_DAMPING, 0),
        }
    }

    /// Nuisances of the window to try next; `None` once its fit is finished.
    fn next(&mut self) -> Option<Vec<f64>> {
        if self.lanes.nuisances() == 0 {
            self.stage = Stage::Done;
            return None;
        }
        if let Stage::Shortened(number, now) = self.stage {
            let share = STEP_FRACTIONS.get(number).filter(|_| !self.is_near_target());
            if let Some(share) = share {
                return Some(now.iter().zip(&self.best.1).map(|(a, b)| a + share * (b - a)).collect());
            }
            self.stage = Stage::LevenbergMarquardt(INITIAL_DAMPING, 0);
        }
        match self.stage {
            Stage::LevenbergMarquardt(damping, done) if done < MAX_NUISANCE_STEPS && !self.is_at_target() => {
                let still = vec![0.0; self.lanes.theta.iter().max().map_or(0, |t| t + 1)];
                Some(nuisance_step(self.lanes, &self.best.0, &self.best.1, &still, damping))
            }
            _ => {
                self.stage = Stage::Done;
                None
            }
        }
    }

    /// Up to `most` nuisances (initial state, record parameters, event offsets) of the window to try next,
    /// each for the case that those before it fail.
    fn ahead(&mut self, most: usize) -> Vec<Vec<f64>> {
        let stage = self.stage;
        let mut ahead = Vec::new();
        while ahead.len() < most
            && let Some(nuisance) = self.next()
        {
            ahead.push(nuisance);
            self.stage = self.after_failure();
        }
        self.stage = if ahead.is_empty() { Stage::Done } else { stage };
        ahead
    }

    /// Processes the results of simultaneous trials in order, up to the first that lowers the cost.
    fn accept_ahead(&mut self, trials: Vec<WindowState>) {
        for trial in trials {
            if self.next().is_none() {
                return;
            }
            let falls = trial.0.q < self.best.0.q;
            self.take(trial);
            if falls {
                return;
            }
        }
    }

    /// Stage of the fit after a trial that does not lower the cost.
    fn after_failure(&self) -> Stage<'a> {
        match self.stage {
            Stage::Shortened(number, now) => Stage::Shortened(number + 1, now),
            Stage::LevenbergMarquardt(damping, _) if damping > 10.0 || self.is_near_target() => Stage::Done,
            Stage::LevenbergMarquardt(damping, done) => {
                Stage::LevenbergMarquardt(f64::max(damping * 100.0, 1e-3), done + 1)
            }
            Stage::Done => Stage::Done,
        }
    }

    fn is_at_target(&self) -> bool {
        self.best.0.q <= self.target_cost
    }

    fn is_near_target(&self) -> bool {
        self.best.0.q <= self.target_cost + MAX_EXCESS_COST
    }

    /// Processes the result of one trial: accepts it if it lowers the cost, and sets the next stage.
    fn take(&mut self, trial: WindowState) {
        let gain = self.best.0.q - trial.0.q;
        let falls = trial.0.q < self.best.0.q;
        if !falls {
            self.stage = self.after_failure();
            return;
        }
        self.stage = match self.stage {
            Stage::Shortened(number, now) => Stage::Shortened(number + 1, now),
            Stage::LevenbergMarquardt(_, _) if gain < 1e-4 * trial.0.q => Stage::Done,
            Stage::LevenbergMarquardt(damping, done) => {
                Stage::LevenbergMarquardt(f64::max(damping / 30.0, INITIAL_DAMPING), done + 1)
            }
            Stage::Done => Stage::Done,
        };
        self.best = trial;
    }
}

/// Computes the normal equations of some windows of a sample at given parameters and nuisances (initial
/// state, record parameters, event offsets).
pub(crate) fn assemble_windows(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    windows: &[RecordWindow<'_>],
    lanes: &[Lanes],
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Vec<NormalEquations> {
    let all_windows = windows.iter().zip(lanes).zip(nuisance);
    let points: Vec<Point<'_>> = all_windows
        .map(|((window, lanes), n)| Point::new(h, &*h.system, lanes, window.record, theta, n))
        .collect();
    points.iter().for_each(|_| sample.data.work.count_simulation());
    assemble_batch(&points, lanes, windows, sample.correlation)
}

/// Fits the nuisances (initial state, record parameters, event offsets) of windows from the values
/// `nuisance`.
pub(crate) fn fit_nuisances_from(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    windows: &[RecordWindow<'_>],
    lanes: &[Lanes],
    nuisance: Vec<Vec<f64>>,
) -> Vec<WindowState> {
    let initial = assemble_windows(sample, h, windows, lanes, theta, &nuisance);
    let followers = windows.iter().zip(lanes).zip(initial.into_iter().zip(nuisance));
    let followers =
        followers.map(|((window, lanes), start)| NuisanceFit::from_start(*window, lanes, start)).collect();
    finish_nuisance_fits(sample, h, theta, followers)
}

/// Completes the nuisance fits of all windows at `theta` (the shared parameters); returns the results in the
/// order of the windows.
pub(crate) fn finish_nuisance_fits(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    mut windows: Vec<NuisanceFit<'_>>,
) -> Vec<WindowState> {
    if h.system.simd_batch_size() > 1 {
        while step_batched(sample, h, theta, &mut windows) {}
    } else {
        windows.par_iter_mut().for_each(|window| {
            while let Some(nuisance) = window.next() {
                sample.data.work.count_simulation();
                let point = Point::new(h, &*h.system, window.lanes, window.window.record, theta, &nuisance);
                let normal = assemble_window(&point, window.lanes, window.window, sample.correlation);
                window.take((normal, nuisance));
            }
        });
    }
    windows.into_iter().map(|window| window.best).collect()
}

/// Performs one step of all unfinished windows in one SIMD pass. Returns whether any window was unfinished.
fn step_batched(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    windows: &mut [NuisanceFit<'_>],
) -> bool {
    let next = windows.par_iter_mut().enumerate().map(|(w, window)| (w, window.ahead(1)));
    let mut next: Vec<(usize, Vec<Vec<f64>>)> = next.filter(|(_, ahead)| !ahead.is_empty()).collect();
    let ahead = (h.system.simd_batch_size() / PASS_FRACTION / next.len().max(1)).clamp(1, MAX_STEPS_AHEAD);
    if ahead > 1 {
        next.iter_mut().for_each(|(w, nuisances)| *nuisances = windows[*w].ahead(ahead));
    }
    let tried: Vec<(usize, &Vec<f64>)> =
        next.iter().flat_map(|(w, ahead)| ahead.iter().map(move |nuisance| (*w, nuisance))).collect();
    let tried_windows: Vec<RecordWindow<'_>> = tried.iter().map(|(w, _)| windows[*w].window).collect();
    let lanes: Vec<Lanes> = tried.iter().map(|(w, _)| windows[*w].lanes.clone()).collect();
    let zipped = tried_windows.iter().zip(&lanes).zip(&tried);
    let points: Vec<Point<'_>> = zipped
        .map(|((window, lanes), (_, nuisance))| {
            sample.data.work.count_simulation();
            Point::new(h, &*h.system, lanes, window.record, theta, nuisance)
        })
        .collect();
    let mut done = assemble_batch(&points, &lanes, &tried_windows, sample.correlation).into_iter();
    drop(points);
    let has_unfinished = !next.is_empty();
    for (w, ahead) in next {
        let trials: Vec<WindowState> = done.by_ref().take(ahead.len()).zip(ahead).collect();
        windows[w].accept_ahead(trials);
    }
    has_unfinished
}

#[cfg(test)]
mod tests {
    //! Contract: simulating steps ahead gives the same result in fewer passes, and a predicted rise of the
    //! cost shortens no step.
    use super::*;
    use crate::linear::Square;
    use crate::record::Record;
    use augsim_system::Window;

    /// Normal equations at `x` of the residual `-atan(5 x)`, for which Gauss-Newton steps from afar fail.
    fn normal_at(x: f64) -> NormalEquations {
        let (residual, slope) = (-(5.0 * x).atan(), 5.0 / (1.0 + 25.0 * x * x));
        NormalEquations {
            h: Square { n: 1, a: vec![slope * slope] },
            g: vec![slope * residual],
            q: 1e4 * residual * residual,
            residual_norm_squared: 0.0,
            degrees_of_freedom: 1.0,
            weight: 1.0,
            softening: 0.0,
            events: Vec::new(),
        }
    }

    #[test]
    fn a_window_without_nuisances_is_not_simulated_again() {
        let record = Record::unweighted(Default::default());
        let window = Window { samples: 0..1, start: Vec::new() };
        let window = RecordWindow { record: &record, window: &window };
        let lanes = Lanes::of_starts(0);
        let mut fit = NuisanceFit::after_theta_step(window, &lanes, (normal_at(0.4), Vec::new()), &[], 0.0);
        assert!(fit.ahead(MAX_STEPS_AHEAD).is_empty());
        assert_eq!(fit.best.0.q, normal_at(0.4).q);
    }

    #[test]
    fn a_window_with_the_predicted_cost_has_no_step_shortened() {
        let record = Record::unweighted(Default::default());
        let window = Window { samples: 0..1, start: Vec::new() };
        let window = RecordWindow { record: &record, window: &window };
        let (lanes, now) = (Lanes::of_starts(1), [0.2]);
        let next = |predicted: f64| {
            NuisanceFit::after_theta_step(window, &lanes, (normal_at(0.4), vec![0.4]), &now, predicted).next()
        };
        assert_eq!(next(normal_at(0.4).q), None);
        assert_eq!(next(normal_at(0.2).q), Some(vec![0.2 + STEP_FRACTIONS[0] * 0.2]));
    }

    #[test]
    fn a_quadratic_cost_is_predicted_exactly() {
        let cost = |x: f64| 3.0 + (2.0 - x).powi(2);
        let here = NormalEquations {
            h: Square { n: 1, a: vec![1.0] },
            g: vec![2.0 - 0.5],
            q: cost(0.5),
            ..normal_at(0.0)
        };
        assert!((here.predicted_cost(&[0.7]) - cost(1.2)).abs() < 1e-12);
    }

    #[test]
    fn steps_ahead_equal_steps_one_by_one() {
        let record = Record::unweighted(Default::default());
        let window = Window { samples: 0..1, start: Vec::new() };
        let window = RecordWindow { record: &record, window: &window };
        let lanes = Lanes::of_starts(1);
        let mut saved = 0;
        for x in [0.1, 0.27, 0.4, 1.0, 3.0] {
            let now = [0.2];
            let followers = || {
                let start = || (normal_at(x), vec![x]);
                [
                    NuisanceFit::from_start(window, &lanes, start()),
                    NuisanceFit::after_theta_step(window, &lanes, start(), &now, normal_at(0.2).q),
                ]
            };
            for (mut alone, mut together) in followers().into_iter().zip(followers()) {
                let mut passes = [0, 0];
                while let Some(nuisance) = alone.next() {
                    passes[0] += 1;
                    alone.take((normal_at(nuisance[0]), nuisance));
                }
                loop {
                    let ahead = together.ahead(MAX_STEPS_AHEAD);
                    if ahead.is_empty() {
                        break;
                    }
                    passes[1] += 1;
                    together.accept_ahead(ahead.into_iter().map(|n| (normal_at(n[0]), n)).collect());
                }
                assert_eq!(alone.best.1, together.best.1, "from {x}");
                assert!(passes[1] <= passes[0]);
                saved += passes[0] - passes[1];
            }
        }
        assert!(saved > 3, "{saved} passes saved");
    }
}
