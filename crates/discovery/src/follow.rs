//! Nuisances of windows that follow what all windows share, each on its own: a step that suits most of them may not suit one.
//!
//! Where the system carries many windows in one pass, those that are still on their way are simulated together; where they are few,
//! what each would try next if its step failed stands beside it, in lanes that would be idle. A window does what it would do
//! alone, whatever stands beside it.

use crate::chosen_records::ChosenRecords;
use crate::evaluate::{Lanes, Normal, Point, normal, normals};
use crate::hypothesis::Hypothesis;
use crate::record::Excerpt;
use rayon::prelude::*;

/// A window whose cost is by more above what was foretold for a step is suspected of a kink.
const SURPRISE: f64 = 5.0;
/// Shares of its own step that a window with a surprise is tried at.
const SHORTER: [f64; 2] = [0.2, 0.0];
/// Most steps of a window's own nuisances.
const MOST_FOLLOWING: usize = 8;
/// Most steps of a window that are simulated at once, each for the case that those before it fail.
const MOST_AHEAD: usize = 4;
/// Share of the windows of a pass that cost as much as one.
const AS_ONE: usize = 4;

/// Normal equations of a window, and the nuisances that they are at.
pub(crate) type Settled = (Normal, Vec<f64>);

/// Nuisances after the Gauss-Newton step that goes with a step of theta.
pub(crate) fn nuisance_step(
    l: &Lanes,
    normal: &Normal,
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

/// A window on the way to its own nuisances.
pub(crate) struct Follower<'a> {
    window: Excerpt<'a>,
    lanes: &'a Lanes,
    best: Settled,
    /// Cost that is low enough.
    enough: f64,
    stage: Stage<'a>,
}

/// Step that a window is at.
#[derive(Clone, Copy)]
enum Stage<'a> {
    /// Share number so many of the step from these nuisances.
    Shorter(usize, &'a [f64]),
    /// Levenberg-Marquardt steps with a damping, so many of them done.
    Settling(f64, usize),
    Done,
}

/// Damping of a window's first step.
const FIRST_DAMPING: f64 = 1e-6;

impl<'a> Follower<'a> {
    /// A window that begins at `trial`, after a step from the nuisances `now` for which a cost of no more than `cost` was foretold. One
    /// that is above it by a surprise has its own step shortened before it is believed: one window at a kink (an event more or less)
    /// must not hold back the step of all. A cost that rises as foretold, because the step suits other windows, is no surprise.
    pub fn after_a_step(
        window: Excerpt<'a>,
        lanes: &'a Lanes,
        trial: Settled,
        now: &'a [f64],
        cost: f64,
    ) -> Self {
        Self { window, lanes, best: trial, enough: cost, stage: Stage::Shorter(0, now) }
    }

    /// A window whose cost is to fall as far as it does.
    pub fn anew(window: Excerpt<'a>, lanes: &'a Lanes, start: Settled) -> Self {
        Self { window, lanes, best: start, enough: 0.0, stage: Stage::Settling(FIRST_DAMPING, 0) }
    }

    /// Nuisances that are to be tried next; none once the window has followed.
    fn next(&mut self) -> Option<Vec<f64>> {
        if let Stage::Shorter(number, now) = self.stage {
            let share = SHORTER.get(number).filter(|_| !self.is_expected());
            if let Some(share) = share {
                return Some(now.iter().zip(&self.best.1).map(|(a, b)| a + share * (b - a)).collect());
            }
            self.stage = Stage::Settling(FIRST_DAMPING, 0);
        }
        match self.stage {
            Stage::Settling(damping, done) if done < MOST_FOLLOWING && !self.is_enough() => {
                let still = vec![0.0; self.lanes.theta.iter().max().map_or(0, |t| t + 1)];
                Some(nuisance_step(self.lanes, &self.best.0, &self.best.1, &still, damping))
            }
            _ => {
                self.stage = Stage::Done;
                None
            }
        }
    }

    /// Nuisances that would be tried next and, should they fail, after that: so many of them, or fewer where it would stop.
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

    /// Takes what came of the nuisances that were tried at once, up to the first at which the cost falls.
    fn take_ahead(&mut self, trials: Vec<Settled>) {
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

    /// The step after one at which the cost does not fall.
    fn after_failure(&self) -> Stage<'a> {
        match self.stage {
            Stage::Shorter(number, now) => Stage::Shorter(number + 1, now),
            Stage::Settling(damping, _) if damping > 10.0 || self.is_expected() => Stage::Done,
            Stage::Settling(damping, done) => Stage::Settling(f64::max(damping * 100.0, 1e-3), done + 1),
            Stage::Done => Stage::Done,
        }
    }

    fn is_enough(&self) -> bool {
        self.best.0.q <= self.enough
    }

    fn is_expected(&self) -> bool {
        self.best.0.q <= self.enough + SURPRISE
    }

    /// Takes what came of the nuisances that were tried.
    fn take(&mut self, trial: Settled) {
        let gain = self.best.0.q - trial.0.q;
        let falls = trial.0.q < self.best.0.q;
        if !falls {
            self.stage = self.after_failure();
            return;
        }
        self.stage = match self.stage {
            Stage::Shorter(number, now) => Stage::Shorter(number + 1, now),
            Stage::Settling(_, _) if gain < 1e-4 * trial.0.q => Stage::Done,
            Stage::Settling(damping, done) => {
                Stage::Settling(f64::max(damping / 30.0, FIRST_DAMPING), done + 1)
            }
            Stage::Done => Stage::Done,
        };
        self.best = trial;
    }
}

/// The normal equations of some windows of a sample at a point.
pub(crate) fn assembled_at(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    windows: &[Excerpt<'_>],
    lanes: &[Lanes],
    theta: &[f64],
    nuisance: &[Vec<f64>],
) -> Vec<Normal> {
    let all = windows.iter().zip(lanes).zip(nuisance);
    let points: Vec<Point<'_>> =
        all.map(|((at, lanes), n)| Point::new(h, &*h.system, lanes, at.record, theta, n)).collect();
    points.iter().for_each(|_| sample.data.tally.simulation());
    normals(&points, lanes, windows, sample.correlation)
}

/// Windows whose nuisances settle as well as they do from these ones.
pub(crate) fn settled_from(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    windows: &[Excerpt<'_>],
    lanes: &[Lanes],
    nuisance: Vec<Vec<f64>>,
) -> Vec<Settled> {
    let begun = assembled_at(sample, h, windows, lanes, theta, &nuisance);
    let followers = windows.iter().zip(lanes).zip(begun.into_iter().zip(nuisance));
    let followers = followers.map(|((at, lanes), start)| Follower::anew(*at, lanes, start)).collect();
    followed(sample, h, theta, followers)
}

/// The end of every window's way at `theta`, in their order.
pub(crate) fn followed(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    mut windows: Vec<Follower<'_>>,
) -> Vec<Settled> {
    if h.system.side_by_side() > 1 {
        while step_together(sample, h, theta, &mut windows) {}
    } else {
        windows.par_iter_mut().for_each(|window| {
            while let Some(nuisance) = window.next() {
                sample.data.tally.simulation();
                let point = Point::new(h, &*h.system, window.lanes, window.window.record, theta, &nuisance);
                let normal = normal(&point, window.lanes, window.window, sample.correlation);
                window.take((normal, nuisance));
            }
        });
    }
    windows.into_iter().map(|window| window.best).collect()
}

/// One step of all windows that are still on their way, in one pass; whether there was one.
fn step_together(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    windows: &mut [Follower<'_>],
) -> bool {
    let next = windows.par_iter_mut().enumerate().map(|(w, window)| (w, window.ahead(1)));
    let mut next: Vec<(usize, Vec<Vec<f64>>)> = next.filter(|(_, ahead)| !ahead.is_empty()).collect();
    let ahead = (h.system.side_by_side() / AS_ONE / next.len().max(1)).clamp(1, MOST_AHEAD);
    if ahead > 1 {
        next.iter_mut().for_each(|(w, nuisances)| *nuisances = windows[*w].ahead(ahead));
    }
    let tried: Vec<(usize, &Vec<f64>)> =
        next.iter().flat_map(|(w, ahead)| ahead.iter().map(move |nuisance| (*w, nuisance))).collect();
    let excerpts: Vec<Excerpt<'_>> = tried.iter().map(|(w, _)| windows[*w].window).collect();
    let lanes: Vec<Lanes> = tried.iter().map(|(w, _)| windows[*w].lanes.clone()).collect();
    let all = excerpts.iter().zip(&lanes).zip(&tried);
    let points: Vec<Point<'_>> = all
        .map(|((at, lanes), (_, nuisance))| {
            sample.data.tally.simulation();
            Point::new(h, &*h.system, lanes, at.record, theta, nuisance)
        })
        .collect();
    let mut done = normals(&points, &lanes, &excerpts, sample.correlation).into_iter();
    drop(points);
    let any = !next.is_empty();
    for (w, ahead) in next {
        let trials: Vec<Settled> = done.by_ref().take(ahead.len()).zip(ahead).collect();
        windows[w].take_ahead(trials);
    }
    any
}

#[cfg(test)]
mod tests {
    //! Contract: a window whose steps are simulated ahead goes the way that it goes step by step, in fewer passes; a cost that rises as
    //! foretold is no surprise.
    use super::*;
    use crate::linear::Square;
    use crate::record::Record;
    use augsim_physics::system::Window;

    /// The cost of a start `x` whose residual is `-atan(5 x)`: steps of Gauss and Newton fail from afar.
    fn at(x: f64) -> Normal {
        let (residual, slope) = (-(5.0 * x).atan(), 5.0 / (1.0 + 25.0 * x * x));
        Normal {
            h: Square { n: 1, a: vec![slope * slope] },
            g: vec![slope * residual],
            q: 1e4 * residual * residual,
            misfit: 0.0,
            freedom: 1.0,
            weight: 1.0,
            softening: 0.0,
            events: Vec::new(),
        }
    }

    #[test]
    fn a_window_that_is_as_foretold_has_no_step_shortened() {
        let record = Record { seen: Default::default(), weight: Vec::new(), tolerated: false };
        let window = Window { samples: 0..1, start: Vec::new() };
        let window = Excerpt { record: &record, window: &window };
        let (lanes, now) = (Lanes::of_starts(1), [0.2]);
        let next = |foretold: f64| {
            Follower::after_a_step(window, &lanes, (at(0.4), vec![0.4]), &now, foretold).next()
        };
        assert_eq!(next(at(0.4).q), None);
        assert_eq!(next(at(0.2).q), Some(vec![0.2 + SHORTER[0] * 0.2]));
    }

    #[test]
    fn a_quadratic_cost_is_foretold_exactly() {
        let cost = |x: f64| 3.0 + (2.0 - x).powi(2);
        let here = Normal { h: Square { n: 1, a: vec![1.0] }, g: vec![2.0 - 0.5], q: cost(0.5), ..at(0.0) };
        assert!((here.foretold(&[0.7]) - cost(1.2)).abs() < 1e-12);
    }

    #[test]
    fn steps_ahead_are_those_step_by_step() {
        let record = Record { seen: Default::default(), weight: Vec::new(), tolerated: false };
        let window = Window { samples: 0..1, start: Vec::new() };
        let window = Excerpt { record: &record, window: &window };
        let lanes = Lanes::of_starts(1);
        let mut saved = 0;
        for x in [0.1, 0.27, 0.4, 1.0, 3.0] {
            let now = [0.2];
            let followers = || {
                let start = || (at(x), vec![x]);
                [
                    Follower::anew(window, &lanes, start()),
                    Follower::after_a_step(window, &lanes, start(), &now, at(0.2).q),
                ]
            };
            for (mut alone, mut together) in followers().into_iter().zip(followers()) {
                let mut passes = [0, 0];
                while let Some(nuisance) = alone.next() {
                    passes[0] += 1;
                    alone.take((at(nuisance[0]), nuisance));
                }
                loop {
                    let ahead = together.ahead(MOST_AHEAD);
                    if ahead.is_empty() {
                        break;
                    }
                    passes[1] += 1;
                    together.take_ahead(ahead.into_iter().map(|n| (at(n[0]), n)).collect());
                }
                assert_eq!(alone.best.1, together.best.1, "from {x}");
                assert!(passes[1] <= passes[0]);
                saved += passes[0] - passes[1];
            }
        }
        assert!(saved > 3, "{saved} passes saved");
    }
}
