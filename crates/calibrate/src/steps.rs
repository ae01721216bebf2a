//! Steps of Levenberg and Marquardt with start states eliminated window by window.

use crate::normal::{Normal, Part, Place};
use crate::windows::{Problem, Shot};
use augsim_linear::{Mat, solve_positive_definite};
use augsim_physics::system::SimulationError;

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
    /// Scale of the misfit of each channel, in its unit: set by their median on the way.
    pub sd: Vec<f64>,
    pub normal: Normal,
    pub steps: usize,
    pub converged: bool,
}

/// The begin of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Begin<'b> {
    pub values: &'b [f64],
    pub shots: &'b [Shot],
    /// Scale of the misfit of each channel, in its unit.
    pub sd: &'b [f64],
}

/// Normal equations that a fit under way waits for.
#[derive(Debug)]
enum Next {
    /// Those of its begin.
    Begin,
    /// Those where it is, with new scales.
    Rescaled,
    /// Those of a step that may be taken.
    Trial(Vec<f64>, Vec<Shot>),
    /// None: it has come to its end.
    End,
}

/// A fit under way.
#[derive(Debug)]
struct Descent<'k> {
    fit: Fit,
    /// Scales of channels whose noise is known.
    known: &'k [Option<f64>],
    settled: f64,
    /// Times that the scales are still to be set.
    rounds: usize,
    damping: f64,
    next: Next,
}

impl<'k> Descent<'k> {
    fn new(begin: &Begin<'_>, known: &'k [Option<f64>], settled: f64) -> Self {
        let normal = Normal { parts: Vec::new(), cost: f64::INFINITY };
        let (values, shots, sd) = (begin.values.to_vec(), begin.shots.to_vec(), begin.sd.to_vec());
        let fit = Fit { values, shots, sd, normal, steps: 0, converged: false };
        // Misfits are large before the first fit, and what is an outlier shows after it: twice for a fit that counts.
        let rounds = if settled < ROUGHLY_SETTLED { 2 } else { 1 };
        Self { fit, known, settled, rounds, damping: 1e-3, next: Next::Begin }
    }

    /// Where it waits for normal equations.
    fn place(&self) -> Option<Place<'_>> {
        let sd = &self.fit.sd;
        match &self.next {
            Next::Begin | Next::Rescaled => {
                Some(Place { values: &self.fit.values, shots: &self.fit.shots, sd })
            }
            Next::Trial(values, shots) => Some(Place { values, shots, sd }),
            Next::End => None,
        }
    }

    /// Goes on with the normal equations that it waited for.
    ///
    /// # Errors
    /// A window that cannot be simulated where the fit stands; a step that leads to such a place is not taken.
    fn take(
        &mut self,
        problem: &Problem<'_>,
        found: Result<Normal, SimulationError>,
    ) -> Result<(), SimulationError> {
        match std::mem::replace(&mut self.next, Next::End) {
            Next::Begin => {
                self.fit.normal = found?;
                self.rescale();
            }
            Next::Rescaled => {
                self.fit.normal = found?;
                self.fit.converged = false;
                self.propose(problem);
            }
            Next::Trial(values, shots) => {
                let most = self.fit.normal.cost * (1.0 + ROUNDING);
                let Some(trial) = found.ok().filter(|t| t.cost.is_finite() && t.cost <= most) else {
                    self.damping *= 5.0;
                    self.propose(problem);
                    return Ok(());
                };
                let gain = self.fit.normal.cost - trial.cost;
                // Beyond rounding nothing is left to gain.
                let is_settled = gain <= 0.0 || gain <= self.settled * self.fit.normal.cost;
                if gain > 0.0 {
                    (self.fit.values, self.fit.shots, self.fit.normal) = (values, shots, trial);
                    self.damping = (self.damping * 0.2).max(1e-12);
                }
                if is_settled {
                    self.fit.converged = true;
                    self.rescale();
                } else {
                    self.propose(problem);
                }
            }
            Next::End => {}
        }
        Ok(())
    }

    /// Looks for the next step to try.
    fn propose(&mut self, problem: &Problem<'_>) {
        let fit = &mut self.fit;
        while fit.steps < MOST_STEPS && self.damping < MOST_DAMPING {
            fit.steps += 1;
            if let Some((values, shots)) = problem.step(&fit.values, &fit.shots, &fit.normal, self.damping) {
                // With derivatives at once: most steps are taken, and then these are the next equations.
                self.next = Next::Trial(values, shots);
                return;
            }
            self.damping *= 10.0;
        }
        self.rescale();
    }

    /// Sets the scales by the misfits, or ends where that was done often enough.
    fn rescale(&mut self) {
        if self.rounds == 0 {
            return;
        }
        self.rounds -= 1;
        let scales = self.fit.normal.scales(self.fit.sd.len());
        for (channel, (sd, scale)) in self.fit.sd.iter_mut().zip(scales).enumerate() {
            let floor = (1e-9 * *sd).max(f64::MIN_POSITIVE);
            *sd = self.known.get(channel).copied().flatten().unwrap_or(scale).max(floor);
        }
        self.next = Next::Rescaled;
    }
}

impl Problem<'_> {
    /// Fits from `begin`.
    ///
    /// # Errors
    /// The first window that cannot be simulated at the beginning.
    pub fn fit(&self, begin: &Begin<'_>, settled: f64) -> Result<Fit, SimulationError> {
        self.fit_with(begin, &[], settled)
    }

    /// Fits as [`fit`](Self::fit) does, with `known` scales of the misfits of channels whose noise is known, in their unit.
    ///
    /// # Errors
    /// The first window that cannot be simulated at the beginning.
    pub fn fit_with(
        &self,
        begin: &Begin<'_>,
        known: &[Option<f64>],
        settled: f64,
    ) -> Result<Fit, SimulationError> {
        self.descended(vec![Descent::new(begin, known, settled)]).swap_remove(0)
    }

    /// Fits from several begins side by side, each as if it were alone.
    pub fn fit_each(&self, begins: &[Begin<'_>], settled: f64) -> Vec<Result<Fit, SimulationError>> {
        self.descended(begins.iter().map(|begin| Descent::new(begin, &[], settled)).collect())
    }

    /// The ends of fits under way, which go on together.
    fn descended(&self, descents: Vec<Descent<'_>>) -> Vec<Result<Fit, SimulationError>> {
        let mut descents: Vec<Result<Descent<'_>, SimulationError>> = descents.into_iter().map(Ok).collect();
        loop {
            let waiting =
                descents.iter().enumerate().filter_map(|(n, d)| Some((n, d.as_ref().ok()?.place()?)));
            let (numbers, places): (Vec<usize>, Vec<Place<'_>>) = waiting.unzip();
            if places.is_empty() {
                break;
            }
            for (n, found) in numbers.into_iter().zip(self.normals(&places)) {
                let taken = descents[n].as_mut().map(|descent| descent.take(self, found));
                if let Ok(Err(error)) = taken {
                    descents[n] = Err(error);
                }
            }
        }
        descents.into_iter().map(|descent| descent.map(|d| d.fit)).collect()
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
        let solution = solve_positive_definite(&scaled, &right)?;
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
    let inverse = solve_positive_definite(&scaled, &unit)?;
    Some(Mat::from_fn(n, n, |i, k| inverse[(i, k)] / (size(i) * size(k))))
}

#[cfg(test)]
mod tests {
    //! Contract: fits side by side are, to the last bit, those that each would be alone; one that cannot begin leaves the others.
    use super::*;
    use augsim_physics::system::{Record, System};
    use augsim_written::{WrittenSystem, model};

    /// A decay that is measured with an error that has no pattern, in windows of a second.
    fn decay() -> (WrittenSystem, Vec<Record>) {
        let text = "scenario = \"system\"\n[states]\nx_m = { start = \"y_m\" }\n[parameters]\n\
                    rate_per_s = { nominal = 0.3, min = 0.0, max = 10.0 }\n[rates]\nx_m = \"-rate_per_s * x_m\"\n\
                    [outputs]\ny_m = { value = \"x_m\", sd = \"estimate\" }\n";
        let model = model::parse(text, "decay.toml").unwrap();
        let system = WrittenSystem::declared_only(&model).unwrap().with_windows(Some(1.0));
        let times: Vec<f64> = (0..101).map(|k| 0.1 * f64::from(k)).collect();
        let error = |k: usize| 0.02 * ((7 * k % 11) as f64 - 5.0) / 5.0;
        let values = times.iter().enumerate().map(|(k, t)| (-0.4 * t).exp() + error(k)).collect();
        let mut record = Record { id: "1".into(), times, values: vec![values], ..Record::default() };
        system.prepare(&mut record, &[]).unwrap();
        (system, vec![record])
    }

    #[test]
    fn fits_side_by_side_are_those_of_each_alone() {
        let (system, records) = decay();
        let problem = Problem::new(&system, &records, true);
        let (shots, sd) = (problem.shots(), problem.spread());
        assert_eq!(shots.len(), 10);
        let values = [[0.1], [f64::NAN], [0.7], [5.0]];
        let begins: Vec<Begin<'_>> =
            values.iter().map(|values| Begin { values, shots: &shots, sd: &sd }).collect();
        let together = problem.fit_each(&begins, SETTLED);
        assert!(together[1].is_err());
        for (begin, fit) in begins.iter().zip(&together) {
            match (problem.fit(begin, SETTLED), fit) {
                (Ok(alone), Ok(fit)) => {
                    assert_eq!((&alone.values, alone.steps, &alone.sd), (&fit.values, fit.steps, &fit.sd));
                    assert!((alone.values[0] - 0.4).abs() < 0.05, "{}", alone.values[0]);
                }
                (Err(_), Err(_)) => {}
                (alone, fit) => panic!("{alone:?} alone and {fit:?}"),
            }
        }
    }
}
