//! Steps of Levenberg and Marquardt with start states eliminated window by window.

use crate::normal::{Normal, Part};
use crate::windows::{Problem, Shot};
use augsim_physics::system::SimulationError;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Steps of one fit, accepted or not.
const MOST_STEPS: usize = 60;
/// A fit has come to its end when a step lowers the cost by less than this share.
pub(crate) const SETTLED: f64 = 1e-8;
/// A fit to windows on the way to longer ones has come to its end when a step lowers the cost by less than this share.
pub(crate) const ROUGHLY_SETTLED: f64 = 1e-4;
/// Share of the cost that rounding may add to a step that changes nothing.
const ROUNDING: f64 = 1e-10;
/// Damping that no fit comes back from.
const MOST_DAMPING: f64 = 1e12;
/// Share of a diagonal that is always added: a start state that a short window does not show has no curvature.
const RIDGE: f64 = 1e-12;

/// The end of a fit.
#[derive(Debug)]
pub(crate) struct Fit {
    pub values: Vec<f64>,
    pub shots: Vec<Shot>,
    pub normal: Normal,
    pub steps: usize,
    pub converged: bool,
}

impl Problem<'_> {
    /// Fits from `values` and the starts of `shots`. The scale of misfits is set by their median on the way.
    ///
    /// # Errors
    /// The first window that cannot be simulated at the beginning.
    pub fn fit(&mut self, values: &[f64], shots: &[Shot], settled: f64) -> Result<Fit, SimulationError> {
        self.fit_with(values, shots, &[], settled)
    }

    /// Fits as [`fit`](Self::fit) does, with `known` scales of the misfits of channels whose noise is known, in their unit.
    ///
    /// # Errors
    /// The first window that cannot be simulated at the beginning.
    pub fn fit_with(
        &mut self,
        values: &[f64],
        shots: &[Shot],
        known: &[Option<f64>],
        settled: f64,
    ) -> Result<Fit, SimulationError> {
        let (mut values, mut shots) = (values.to_vec(), shots.to_vec());
        let channels = self.schema().channels.len();
        let mut normal = self.normal(&values, &shots, true)?;
        let mut damping = 1e-3;
        let mut converged = false;
        let mut steps = 0;
        // Misfits are large before the first fit, and what is an outlier shows after it: twice for a fit that counts.
        let rounds = if settled < ROUGHLY_SETTLED { 2 } else { 1 };
        for _ in 0..rounds {
            let scales = normal.scales(channels);
            for (channel, (sd, scale)) in self.sd.iter_mut().zip(scales).enumerate() {
                let floor = (1e-9 * *sd).max(f64::MIN_POSITIVE);
                *sd = known.get(channel).copied().flatten().unwrap_or(scale).max(floor);
            }
            normal = self.normal(&values, &shots, true)?;
            converged = false;
            while steps < MOST_STEPS && damping < MOST_DAMPING {
                steps += 1;
                let Some((moved, starts)) = self.step(&values, &shots, &normal, damping) else {
                    damping *= 10.0;
                    continue;
                };
                // With derivatives at once: most steps are taken, and then these are the next equations.
                let trial = self.normal(&moved, &starts, true).ok().filter(|t| t.cost.is_finite());
                let Some(trial) = trial.filter(|t| t.cost <= normal.cost * (1.0 + ROUNDING)) else {
                    damping *= 5.0;
                    continue;
                };
                let gain = normal.cost - trial.cost;
                if gain <= 0.0 {
                    // Beyond rounding nothing is left to gain.
                    converged = true;
                    break;
                }
                let is_settled = gain <= settled * normal.cost;
                (values, shots, normal) = (moved, starts, trial);
                damping = (damping * 0.2).max(1e-12);
                if is_settled {
                    converged = true;
                    break;
                }
            }
        }
        Ok(Fit { values, shots, normal, steps, converged })
    }

    /// Values and starts after a step; `None` where the equations have no solution.
    fn step(
        &self,
        values: &[f64],
        shots: &[Shot],
        normal: &Normal,
        damping: f64,
    ) -> Option<(Vec<f64>, Vec<Shot>)> {
        let n = self.states.len();
        let reduced = Reduced::of(self, normal, damping)?;
        // A parameter at its bound that wants to go beyond stays, and the others are found without it.
        let declared = self.system.parameters();
        let mut moving: Vec<usize> = (0..self.free.len()).collect();
        let mut change = vec![0.0; self.free.len()];
        loop {
            let step = reduced.solve(&moving, damping)?;
            change.fill(0.0);
            moving.iter().zip(&step).for_each(|(i, s)| change[*i] = *s);
            let before = moving.len();
            moving.retain(|i| {
                let (p, value) = (&declared[self.free[*i]], values[self.free[*i]]);
                !(change[*i] < 0.0 && value <= p.min || change[*i] > 0.0 && value >= p.max)
            });
            if moving.len() == before || moving.is_empty() {
                (0..change.len()).filter(|i| !moving.contains(i)).for_each(|i| change[i] = 0.0);
                break;
            }
        }
        let mut moved = values.to_vec();
        for (i, place) in self.free.iter().enumerate() {
            let p = &declared[*place];
            moved[*place] = (moved[*place] + change[i]).clamp(p.min, p.max);
            change[i] = moved[*place] - values[*place];
        }
        let mut starts = shots.to_vec();
        for ((shot, part), inverse) in starts.iter_mut().zip(&normal.parts).zip(&reduced.windows) {
            let mut right = part.h.clone();
            for (i, by) in change.iter().enumerate() {
                right.iter_mut().zip(&part.b[i * n..(i + 1) * n]).for_each(|(r, b)| *r -= by * b);
            }
            for (k, state) in self.states.iter().enumerate() {
                shot.start[*state] += (0..n).map(|j| inverse[(k, j)] * right[j]).sum::<f64>();
            }
        }
        let finite = moved.iter().chain(starts.iter().flat_map(|s| &s.start)).all(|x| x.is_finite());
        finite.then_some((moved, starts))
    }
}

/// The normal equations of the parameters with the starts eliminated.
pub(crate) struct Reduced {
    pub s: Mat<f64>,
    pub g: Vec<f64>,
    /// Inverse of each window's matrix of its start.
    pub windows: Vec<Mat<f64>>,
}

impl Reduced {
    pub fn of(problem: &Problem<'_>, normal: &Normal, damping: f64) -> Option<Self> {
        let (p, n) = (problem.free.len(), problem.states.len());
        let mut s = Mat::<f64>::zeros(p, p);
        let mut g = vec![0.0; p];
        let mut windows = Vec::with_capacity(normal.parts.len());
        for part in &normal.parts {
            let inverse = inverse(part, n, damping)?;
            let b = Mat::from_fn(p, n, |i, k| part.b[i * n + k]);
            let through = &b * &inverse;
            let taken = &through * b.transpose();
            for i in 0..p {
                g[i] += part.g[i] - (0..n).map(|k| through[(i, k)] * part.h[k]).sum::<f64>();
                for j in 0..=i {
                    s[(i, j)] += part.a[i * p + j] - taken[(i, j)];
                }
            }
            windows.push(inverse);
        }
        for i in 0..p {
            for j in 0..i {
                s[(j, i)] = s[(i, j)];
            }
        }
        Some(Self { s, g, windows })
    }

    /// Step of the parameters `moving`, the others held, in units in which all curvatures are 1.
    fn solve(&self, moving: &[usize], damping: f64) -> Option<Vec<f64>> {
        if moving.is_empty() {
            return Some(Vec::new());
        }
        let size = |i: usize| self.s[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        let scaled = Mat::from_fn(moving.len(), moving.len(), |i, j| {
            let (a, b) = (moving[i], moving[j]);
            self.s[(a, b)] / (size(a) * size(b)) + if i == j { damping + RIDGE } else { 0.0 }
        });
        let right = Mat::from_fn(moving.len(), 1, |i, _| self.g[moving[i]] / size(moving[i]));
        let solution = scaled.llt(Side::Lower).ok()?.solve(&right);
        let step: Vec<f64> = (0..moving.len()).map(|i| solution[(i, 0)] / size(moving[i])).collect();
        step.iter().all(|x| x.is_finite()).then_some(step)
    }
}

/// Inverse of a window's damped matrix of its start.
fn inverse(part: &Part, n: usize, damping: f64) -> Option<Mat<f64>> {
    if n == 0 {
        return Some(Mat::zeros(0, 0));
    }
    let at = |i: usize, k: usize| part.c[i.max(k) * n + i.min(k)];
    let most = (0..n).map(|i| at(i, i)).fold(f64::MIN_POSITIVE, f64::max);
    // A state that the window does not show at all has no curvature of its own to be damped by.
    let size = |i: usize| at(i, i).max(RIDGE * most).sqrt();
    let scaled = Mat::from_fn(n, n, |i, k| {
        at(i, k) / (size(i) * size(k)) + if i == k { damping + 1e-10 } else { 0.0 }
    });
    let unit = Mat::<f64>::identity(n, n);
    let inverse = scaled.llt(Side::Lower).ok()?.solve(&unit);
    Some(Mat::from_fn(n, n, |i, k| inverse[(i, k)] / (size(i) * size(k))))
}
