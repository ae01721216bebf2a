//! Calibration: bounded Levenberg-Marquardt over windows with their starts eliminated and their weights robust.

use super::evaluate::{Piece, piece};
use super::hypothesis::{Hypothesis, amounts};
use super::measured::{Measured, Window};
use crate::covariance::undetermined;
use crate::dispersion::Quadratic;
use crate::linear::Square;
use crate::statistics::chi2_quantile;
use rayon::prelude::*;
use std::ops::Range;

const MOST_ITERATIONS: usize = 15;
const MOST_TRIES: usize = 6;
/// A window's mean squared residual from which its cost is bent, in units of the typical one: three standard deviations.
pub(crate) const BEND: f64 = 9.0;

/// Windows that a fit sees.
#[derive(Clone, Debug)]
pub(crate) struct Sample<'a> {
    pub data: &'a Measured,
    pub windows: Vec<Window>,
    /// Mean squared residual of a window, in units of the noise, from which its cost grows with the logarithm only: a window
    /// that no parameter can bring near the model must not steer them.
    pub bend: f64,
    /// The windows of one push are no independent samples.
    pub by_push: bool,
}

impl Sample<'_> {
    /// Cost of a window and its slope.
    pub fn cost(&self, q: f64, m: usize) -> (f64, f64) {
        let knee = self.bend * m as f64;
        if q <= knee { (q, 1.0) } else { (knee * (1.0 + (q / knee).ln()), knee / q) }
    }

    /// Windows that are independent of each other: each, or those of each push.
    pub fn clusters(&self) -> Vec<Range<usize>> {
        let mut all: Vec<Range<usize>> = Vec::new();
        for (i, w) in self.windows.iter().enumerate() {
            match all.last_mut() {
                Some(c) if self.by_push && self.windows[c.start].record == w.record => c.end = i + 1,
                _ => all.push(i..i + 1),
            }
        }
        all
    }

    /// Cost of all windows.
    pub fn total(&self, pieces: &[Piece]) -> f64 {
        pieces.iter().map(|p| self.cost(p.q, p.m).0).sum()
    }

    pub fn starts(&self) -> Vec<[f64; 3]> {
        self.windows.iter().map(|w| self.data.records[w.record].pose[w.first]).collect()
    }

    /// The piece of one window; counted as a simulation.
    pub fn piece(&self, h: &Hypothesis, theta: &[f64], start: [f64; 3], w: &Window) -> Piece {
        self.data.tally.simulation();
        piece(h, theta, start, &self.data.records[w.record], w, self.data.noise.sd)
    }

    pub fn pieces(&self, h: &Hypothesis, theta: &[f64], starts: &[[f64; 3]]) -> Vec<Piece> {
        self.windows.par_iter().zip(starts).map(|(w, s)| self.piece(h, theta, *s, w)).collect()
    }

    /// Pieces at new parameters and starts; a window that its new start makes worse keeps the old one, if that is better.
    pub fn guarded(
        &self,
        h: &Hypothesis,
        theta: &[f64],
        moved: &[[f64; 3]],
        old: &[[f64; 3]],
        before: &[Piece],
    ) -> (Vec<[f64; 3]>, Vec<Piece>) {
        self.windows
            .par_iter()
            .zip(moved)
            .zip(old.par_iter().zip(before))
            .map(|((w, &new), (&old, before))| {
                let at = |s| self.piece(h, theta, s, w);
                let trial = at(new);
                if trial.q <= before.q {
                    return (new, trial);
                }
                let kept = at(old);
                if kept.q < trial.q { (old, kept) } else { (new, trial) }
            })
            .unzip()
    }

    /// What one more Gauss-Newton step of everything promises, in the quadratic approximation.
    pub fn promise(&self, pieces: &[Piece], p: usize) -> f64 {
        let (s, mut u, _) = self.normal(pieces, p);
        s.cholesky().forward(&mut u);
        let starts: f64 = pieces.iter().map(|w| self.cost(w.q, w.m).1 * w.start_gain(p)).sum();
        starts + u.iter().map(|v| v * v).sum::<f64>()
    }

    /// Curvature and gradient of the globals, and those of every cluster of windows.
    pub fn normal(&self, pieces: &[Piece], p: usize) -> (Square, Vec<f64>, Vec<Quadratic>) {
        let (mut s, mut u, mut each) = (Square::zero(p), vec![0.0; p], Vec::new());
        for cluster in self.clusters() {
            let (mut sc, mut uc) = (Square::zero(p), vec![0.0; p]);
            for piece in &pieces[cluster] {
                let weight = self.cost(piece.q, piece.m).1;
                let (sw, uw) = piece.reduced(p);
                sc.a.iter_mut().zip(&sw.a).for_each(|(a, b)| *a += weight * b);
                uc.iter_mut().zip(&uw).for_each(|(a, b)| *a += weight * b);
            }
            s.a.iter_mut().zip(&sc.a).for_each(|(a, b)| *a += b);
            u.iter_mut().zip(&uc).for_each(|(a, b)| *a += b);
            each.push((sc, uc));
        }
        (s, u, each)
    }
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub hypothesis: Hypothesis,
    pub theta: Vec<f64>,
    pub starts: Vec<[f64; 3]>,
    pub pieces: Vec<Piece>,
}

impl Fit {
    pub fn cost(&self, sample: &Sample<'_>) -> f64 {
        sample.total(&self.pieces)
    }

    /// Covariance of the globals: the larger, parameter by parameter, of the sandwich over clusters of windows (White 1982) and
    /// of white noise.
    pub fn covariance(&self, sample: &Sample<'_>) -> Square {
        let p = self.theta.len();
        let (s, _, each) = sample.normal(&self.pieces, p);
        let inverse = s.cholesky().inverse();
        let mut cov = Square::zero(p);
        for (_, u) in &each {
            let x: Vec<f64> = (0..p).map(|i| (0..p).map(|j| inverse.at(i, j) * u[j]).sum()).collect();
            for i in 0..p {
                for j in 0..p {
                    *cov.at_mut(i, j) += x[i] * x[j];
                }
            }
        }
        let grow: Vec<f64> =
            (0..p).map(|i| (inverse.at(i, i) / cov.at(i, i).max(1e-300)).max(1.0).sqrt()).collect();
        for i in 0..p {
            for j in 0..p {
                *cov.at_mut(i, j) *= grow[i] * grow[j];
            }
        }
        cov
    }

    /// Whether every added kind is away from its null by more than chance: a gain that comes of corners, where a start meets the
    /// rod, leaves the parameters where they were (Wald test with the covariance of the sandwich).
    pub fn clear(&self, sample: &Sample<'_>) -> bool {
        let (cov, open) = (self.covariance(sample), self.undetermined(sample));
        self.hypothesis.kinds.iter().all(|kind| {
            let range = self.hypothesis.range_of(kind);
            // A direction or a scale has no null of its own.
            let own: Vec<usize> = range.take(amounts(kind)).collect();
            let mut x: Vec<f64> = own.iter().map(|&i| self.theta[i] - self.hypothesis.free[i].null).collect();
            cov.sub(&own).cholesky().forward(&mut x);
            // What poses tell only together with others is not zero for that.
            own.is_empty()
                || own.iter().any(|&i| open[i])
                || x.iter().map(|v| v * v).sum::<f64>() > chi2_quantile(0.05, own.len() as f64)
        })
    }

    /// 95 % intervals of the globals; the bounds where the data say nothing about a parameter but together with others.
    pub fn ci95(&self, sample: &Sample<'_>) -> Vec<[f64; 2]> {
        let cov = self.covariance(sample);
        let open = self.undetermined(sample);
        let free = &self.hypothesis.free;
        self.theta
            .iter()
            .enumerate()
            .map(|(i, v)| {
                let half = 1.96 * cov.at(i, i).max(0.0).sqrt();
                if open[i] { [free[i].min, free[i].max] } else { [v - half, v + half] }
            })
            .collect()
    }

    /// Which globals can be changed together without a change in any pose.
    fn undetermined(&self, sample: &Sample<'_>) -> Vec<bool> {
        undetermined(&sample.normal(&self.pieces, self.theta.len()).0)
    }
}

/// Fits `hypothesis` from `theta`; starts from those of another fit or the first poses.
pub(crate) fn fit(sample: &Sample<'_>, hypothesis: &Hypothesis, theta: &[f64], starts: &[[f64; 3]]) -> Fit {
    sample.data.tally.fit();
    let mut theta = theta.to_vec();
    hypothesis.admit(&mut theta);
    let p = theta.len();
    let mut starts = if starts.is_empty() { sample.starts() } else { starts.to_vec() };
    let mut pieces = sample.pieces(hypothesis, &theta, &starts);
    let mut cost = sample.total(&pieces);
    let mut lambda = 1e-3;
    let mut polished = false;
    for _ in 0..MOST_ITERATIONS {
        let (s, u, _) = sample.normal(&pieces, p);
        let mut gained = None;
        for _ in 0..MOST_TRIES {
            let mut damped = s.clone();
            (0..p).for_each(|i| *damped.at_mut(i, i) *= 1.0 + lambda);
            let mut step = u.clone();
            damped.cholesky().solve(&mut step);
            let mut next: Vec<f64> = theta.iter().zip(&step).map(|(a, b)| a + b).collect();
            hypothesis.free.iter().zip(&mut next).for_each(|(f, v)| {
                let polar = f.kind.is_some_and(|k| super::hypothesis::polar(k).is_some());
                if !polar {
                    *v = v.clamp(f.min, f.max);
                }
            });
            let taken: Vec<f64> = next.iter().zip(&theta).map(|(a, b)| a - b).collect();
            hypothesis.admit(&mut next);
            let shrink = 1.0 / (1.0 + lambda);
            let moved: Vec<[f64; 3]> = pieces
                .iter()
                .zip(&starts)
                .map(|(piece, s)| {
                    let d = piece.start_step(&taken);
                    [0, 1, 2].map(|c| s[c] + shrink * d[c])
                })
                .collect();
            let (moved, trial) = sample.guarded(hypothesis, &next, &moved, &starts, &pieces);
            let trial_cost = sample.total(&trial);
            if trial_cost < cost {
                gained = Some(cost - trial_cost);
                (theta, starts, pieces, cost) = (next, moved, trial, trial_cost);
                lambda = f64::max(lambda / 8.0, 1e-9);
                break;
            }
            lambda *= 8.0;
        }
        match gained {
            Some(gain) if gain > 0.05 + 1e-5 * cost => {}
            // A start that hits the rod turns a corner that no common step follows: each window once by itself.
            _ if !polished => {
                polished = true;
                let fitted = fit_starts_from(sample, hypothesis, &theta, &starts);
                (starts, pieces) = (fitted.starts, fitted.pieces);
                cost = sample.total(&pieces);
                lambda = 1e-3;
            }
            _ => break,
        }
    }
    Fit { hypothesis: hypothesis.clone(), theta, starts, pieces }
}

/// Fits the starts alone, at given parameters; each window for itself.
pub(crate) fn fit_starts(sample: &Sample<'_>, hypothesis: &Hypothesis, theta: &[f64]) -> Fit {
    fit_starts_from(sample, hypothesis, theta, &sample.starts())
}

fn fit_starts_from(sample: &Sample<'_>, hypothesis: &Hypothesis, theta: &[f64], from: &[[f64; 3]]) -> Fit {
    sample.data.tally.fit();
    let still = vec![0.0; theta.len()];
    let (starts, pieces): (Vec<_>, Vec<_>) = sample
        .windows
        .par_iter()
        .zip(from)
        .map(|(w, &(mut start))| {
            let mut now = sample.piece(hypothesis, theta, start, w);
            let mut share = 1.0;
            for _ in 0..6 {
                if now.start_gain(still.len()) < 1e-3 + 1e-6 * now.q {
                    break;
                }
                let d = now.start_step(&still);
                let moved = [0, 1, 2].map(|c| start[c] + share * d[c]);
                let next = sample.piece(hypothesis, theta, moved, w);
                if next.q < now.q {
                    let gain = now.q - next.q;
                    (start, now) = (moved, next);
                    if gain < 1e-3 + 1e-6 * now.q {
                        break;
                    }
                } else {
                    share *= 0.3;
                }
            }
            (start, now)
        })
        .unzip();
    Fit { hypothesis: hypothesis.clone(), theta: theta.to_vec(), starts, pieces }
}
