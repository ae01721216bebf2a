//! Levenberg-Marquardt fits in which the initial states of the windows are eliminated.
//!
//! The initial state x_i of a window enters only the equations of that window, so it is eliminated from (2)
//! of `normal.rs` by a Schur complement. The work grows with the number of windows, not with its cube:
//!
//! ```text
//! (1)  S δp = g,      S = Σ (A_i - B_i C_i⁻¹ B_iᵀ),      g = Σ (g_i - B_i C_i⁻¹ h_i)
//! (2)  δx_i = C_i⁻¹ (h_i - B_iᵀ δp)
//! ```
//!
//! S and every C_i are scaled to a unit diagonal, to which the damping λ is added (Marquardt, SIAM Journal on
//! Applied Mathematics 11, 1963).

use crate::normal::{EvaluationPoint, NormalEquations, WindowEquations};
use crate::windows::{Problem, ShootingWindow};
use augsim_linear::{Mat, solve_positive_definite};
use augsim_system::SimulationError;

/// Maximum number of Levenberg-Marquardt steps of one fit, accepted or rejected.
const MAX_STEPS: usize = 60;
/// Relative decrease of the cost in one step below which a final fit has converged.
pub(crate) const FINAL_TOLERANCE: f64 = 1e-8;
/// Relative decrease of the cost in one step below which an intermediate fit, such as one to short windows,
/// has converged.
pub(crate) const COARSE_TOLERANCE: f64 = 1e-4;
/// Relative increase of the cost that is attributed to rounding errors.
const ROUNDING_TOLERANCE: f64 = 1e-10;
/// Levenberg-Marquardt damping λ at the start of a fit.
const INITIAL_DAMPING: f64 = 1e-3;
/// Levenberg-Marquardt damping λ at which a fit stops.
const MAX_DAMPING: f64 = 1e12;
/// Ridge that is added to the scaled equations S of the parameters (1), whose diagonal is 1.
///
/// It is also the least diagonal element of a window's C_i, as a share of the largest one.
const RIDGE: f64 = 1e-12;
/// Ridge that is added to the scaled curvature C_i in the initial states, whose diagonal is 1, because a
/// short window may not determine every initial state.
const STATE_RIDGE: f64 = 1e-10;

/// Values of all parameters, and the windows with their initial states.
type Values = (Vec<f64>, Vec<ShootingWindow>);

/// Result of a fit of parameters and initial states.
#[derive(Debug)]
pub(crate) struct Fit {
    /// Values of all parameters, estimated and frozen.
    pub values: Vec<f64>,
    pub windows: Vec<ShootingWindow>,
    /// Scale by which the residuals of each channel are divided, in the channel's unit.
    pub scales: Vec<f64>,
    /// Cost and normal equations at the fitted values.
    pub normal: NormalEquations,
    pub steps: usize,
    pub converged: bool,
}

/// Values at which a fit starts: parameters, initial states of the windows, and residual scales.
#[derive(Clone, Debug)]
pub(crate) struct StartingPoint<'b> {
    /// Values of all parameters, estimated and frozen.
    pub values: &'b [f64],
    pub windows: &'b [ShootingWindow],
    /// Scale by which the residuals of each channel are divided, in the channel's unit.
    pub scales: &'b [f64],
}

/// Point at which a fit next needs the normal equations evaluated.
#[derive(Debug)]
enum Pending {
    /// The fit needs the normal equations at its starting point, which was not evaluated yet.
    Start,
    /// The fit needs them at its current point again, because the residual scales have changed.
    Rescaled,
    /// The fit needs them at these trial values, which a proposed step leads to.
    Trial(Values),
    /// The fit is finished and needs no further evaluation.
    Finished,
}

/// A fit in progress, which advances by one evaluation of the normal equations at a time.
#[derive(Debug)]
struct Descent<'k> {
    fit: Fit,
    /// Residual scales of the channels whose noise is known, in the channel's unit; `None` where they are
    /// estimated.
    known_scales: &'k [Option<f64>],
    tolerance: f64,
    /// How many more times the fit estimates the residual scales.
    rescalings_left: usize,
    damping: f64,
    pending: Pending,
}

impl<'k> Descent<'k> {
    fn new(start: &StartingPoint<'_>, known_scales: &'k [Option<f64>], tolerance: f64) -> Self {
        let normal = NormalEquations { windows: Vec::new(), cost: f64::INFINITY };
        let values = start.values.to_vec();
        let (windows, scales) = (start.windows.to_vec(), start.scales.to_vec());
        let fit = Fit { values, windows, scales, normal, steps: 0, converged: false };
        // The residuals before the first fit are too large to be a scale, and outliers stand out only after
        // it: a final fit estimates the scales twice.
        let rescalings_left = if tolerance < COARSE_TOLERANCE { 2 } else { 1 };
        Self {
            fit,
            known_scales,
            tolerance,
            rescalings_left,
            damping: INITIAL_DAMPING,
            pending: Pending::Start,
        }
    }

    /// Point at which the fit next needs the normal equations. `None` if it is finished, or if `is_over` (the
    /// deadline has passed) and the starting point was evaluated.
    fn pending_point(&self, is_over: bool) -> Option<EvaluationPoint<'_>> {
        let Fit { values, windows, scales, .. } = &self.fit;
        match &self.pending {
            Pending::Rescaled | Pending::Trial(_) if is_over => None,
            Pending::Start | Pending::Rescaled => Some(EvaluationPoint { values, windows, scales }),
            Pending::Trial((values, windows)) => Some(EvaluationPoint { values, windows, scales }),
            Pending::Finished => None,
        }
    }

    /// Advances the fit by one evaluation: `evaluated` are the normal equations at the point that
    /// [`pending_point`](Self::pending_point) returned.
    ///
    /// # Errors
    /// A window cannot be simulated at the current point. A trial step to such a point is rejected instead.
    fn advance(
        &mut self,
        problem: &Problem<'_>,
        evaluated: Result<NormalEquations, SimulationError>,
    ) -> Result<(), SimulationError> {
        match std::mem::replace(&mut self.pending, Pending::Finished) {
            Pending::Start => {
                self.fit.normal = evaluated?;
                self.rescale();
            }
            Pending::Rescaled => {
                self.fit.normal = evaluated?;
                self.fit.converged = false;
                self.propose_step(problem);
            }
            Pending::Trial(values) => self.judge_trial(problem, values, evaluated.ok()),
            Pending::Finished => {}
        }
        Ok(())
    }

    /// Accepts or rejects a trial step; then proposes the next one, or rescales the residuals if the fit
    /// converged.
    fn judge_trial(&mut self, problem: &Problem<'_>, values: Values, trial: Option<NormalEquations>) {
        let max_cost = self.fit.normal.cost * (1.0 + ROUNDING_TOLERANCE);
        let Some(trial) = trial.filter(|t| t.cost.is_finite() && t.cost <= max_cost) else {
            self.damping *= 5.0;
            self.propose_step(problem);
            return;
        };
        let decrease = self.fit.normal.cost - trial.cost;
        // An increase within rounding is not accepted, but shows that there is nothing left to gain.
        let has_converged = decrease <= 0.0 || decrease <= self.tolerance * self.fit.normal.cost;
        if decrease > 0.0 {
            (self.fit.values, self.fit.windows) = values;
            self.fit.normal = trial;
            self.damping = (self.damping * 0.2).max(1e-12);
        }
        if has_converged {
            self.fit.converged = true;
            self.rescale();
        } else {
            self.propose_step(problem);
        }
    }

    /// Computes the next trial step. Rescales the residuals instead if no steps are left or the damping is at
    /// its limit.
    fn propose_step(&mut self, problem: &Problem<'_>) {
        let fit = &mut self.fit;
        while fit.steps < MAX_STEPS && self.damping < MAX_DAMPING {
            fit.steps += 1;
            if let Some(values) = problem.step_from(&fit.values, &fit.windows, &fit.normal, self.damping) {
                // The trial is evaluated with derivatives at once: most steps are accepted, and then these
                // are the equations of the next step.
                self.pending = Pending::Trial(values);
                return;
            }
            self.damping *= 10.0;
        }
        self.rescale();
    }

    /// Estimates the residual scales again and restarts the steps; finishes the fit if no rescalings are
    /// left.
    fn rescale(&mut self) {
        if self.rescalings_left == 0 {
            return;
        }
        self.rescalings_left -= 1;
        let estimates = self.fit.normal.scales(self.fit.scales.len());
        for (channel, (scale, estimate)) in self.fit.scales.iter_mut().zip(estimates).enumerate() {
            let floor = (1e-9 * *scale).max(f64::MIN_POSITIVE);
            *scale = self.known_scales.get(channel).copied().flatten().unwrap_or(estimate).max(floor);
        }
        self.pending = Pending::Rescaled;
    }
}

impl Problem<'_> {
    /// Fits parameters and initial states from a starting point by Levenberg-Marquardt steps.
    ///
    /// # Errors
    /// The first window that cannot be simulated at the starting point.
    pub fn fit(&self, start: &StartingPoint<'_>, tolerance: f64) -> Result<Fit, SimulationError> {
        self.fit_with_known_scales(start, &[], tolerance)
    }

    /// As [`fit`](Self::fit), with known residual scales of some channels, in their units; `None` where
    /// estimated.
    ///
    /// # Errors
    /// The first window that cannot be simulated at the starting point.
    pub fn fit_with_known_scales(
        &self,
        start: &StartingPoint<'_>,
        known_scales: &[Option<f64>],
        tolerance: f64,
    ) -> Result<Fit, SimulationError> {
        self.run_descents(vec![Descent::new(start, known_scales, tolerance)]).swap_remove(0)
    }

    /// Fits from several starting points in common SIMD batches. Each result equals that of
    /// [`fit`](Self::fit).
    pub fn fit_each(
        &self,
        starts: &[StartingPoint<'_>],
        tolerance: f64,
    ) -> Vec<Result<Fit, SimulationError>> {
        self.run_descents(starts.iter().map(|start| Descent::new(start, &[], tolerance)).collect())
    }

    /// Runs several fits until all are finished; each round evaluates the normal equations of the unfinished
    /// ones.
    fn run_descents(&self, descents: Vec<Descent<'_>>) -> Vec<Result<Fit, SimulationError>> {
        let mut descents: Vec<Result<Descent<'_>, SimulationError>> = descents.into_iter().map(Ok).collect();
        loop {
            let is_over = self.is_over();
            let pending = descents
                .iter()
                .enumerate()
                .filter_map(|(index, d)| Some((index, d.as_ref().ok()?.pending_point(is_over)?)));
            let (indices, points): (Vec<usize>, Vec<EvaluationPoint<'_>>) = pending.unzip();
            if points.is_empty() {
                break;
            }
            for (index, evaluated) in indices.into_iter().zip(self.normal_equations(&points)) {
                let advanced = descents[index].as_mut().map(|descent| descent.advance(self, evaluated));
                if let Ok(Err(error)) = advanced {
                    descents[index] = Err(error);
                }
            }
        }
        descents.into_iter().map(|descent| descent.map(|d| d.fit)).collect()
    }

    /// Computes parameters and windows after one damped step; `None` if the equations have no finite
    /// solution.
    fn step_from(
        &self,
        values: &[f64],
        windows: &[ShootingWindow],
        normal: &NormalEquations,
        damping: f64,
    ) -> Option<Values> {
        let n = self.free_states.len();
        let reduced = ReducedEquations::eliminate_states(self, normal, damping)?;
        let mut change = self.parameter_step(values, &reduced, damping)?;
        let declared = self.system.parameters();
        let mut new_values = values.to_vec();
        for (i, parameter) in self.free_parameters.iter().enumerate() {
            let p = &declared[*parameter];
            new_values[*parameter] = (new_values[*parameter] + change[i]).clamp(p.min, p.max);
            change[i] = new_values[*parameter] - values[*parameter];
        }
        let mut new_windows = windows.to_vec();
        for ((window, equations), inverse) in
            new_windows.iter_mut().zip(&normal.windows).zip(&reduced.state_inverses)
        {
            let mut right = equations.h.clone();
            for (i, by) in change.iter().enumerate() {
                right.iter_mut().zip(&equations.b[i * n..(i + 1) * n]).for_each(|(r, b)| *r -= by * b);
            }
            for (k, state) in self.free_states.iter().enumerate() {
                window.initial_state[*state] += (0..n).map(|j| inverse[(k, j)] * right[j]).sum::<f64>();
            }
        }
        let initial_states = new_windows.iter().flat_map(|w| &w.initial_state);
        let is_finite = new_values.iter().chain(initial_states).all(|x| x.is_finite());
        is_finite.then_some((new_values, new_windows))
    }

    /// Computes the step of the free parameters within their bounds.
    ///
    /// A parameter at a bound that would leave its range is fixed. Each fixed parameter changes the step of
    /// the others, so they are solved for again until none leaves its range.
    fn parameter_step(&self, values: &[f64], reduced: &ReducedEquations, damping: f64) -> Option<Vec<f64>> {
        let declared = self.system.parameters();
        let mut moving: Vec<usize> = (0..self.free_parameters.len()).collect();
        let mut change = vec![0.0; self.free_parameters.len()];
        loop {
            let step = reduced.solve(&moving, damping)?;
            change.fill(0.0);
            moving.iter().zip(&step).for_each(|(i, s)| change[*i] = *s);
            let before = moving.len();
            moving.retain(|i| {
                let parameter = self.free_parameters[*i];
                let (p, value) = (&declared[parameter], values[parameter]);
                !(change[*i] < 0.0 && value <= p.min || change[*i] > 0.0 && value >= p.max)
            });
            if moving.len() == before || moving.is_empty() {
                (0..change.len()).filter(|i| !moving.contains(i)).for_each(|i| change[i] = 0.0);
                return Some(change);
            }
        }
    }
}

/// Normal equations (1) of the parameters, from which the initial states are eliminated.
pub(crate) struct ReducedEquations {
    /// Schur complement S of the parameters, formula (1), `[parameter, parameter]`.
    pub matrix: Mat<f64>,
    /// Right-hand side g of the reduced equations (1), by parameter.
    pub right: Vec<f64>,
    /// Damped inverse of the curvature in the initial state of each window, C_i⁻¹ in (1).
    pub state_inverses: Vec<Mat<f64>>,
}

impl ReducedEquations {
    /// Eliminates the initial states of all windows; `None` if the C_i of a window is not positive definite.
    pub fn eliminate_states(problem: &Problem<'_>, normal: &NormalEquations, damping: f64) -> Option<Self> {
        let (p, n) = (problem.free_parameters.len(), problem.free_states.len());
        let mut matrix = Mat::<f64>::zeros(p, p);
        let mut right = vec![0.0; p];
        let mut state_inverses = Vec::with_capacity(normal.windows.len());
        for window in &normal.windows {
            let inverse = invert_state_block(window, n, damping)?;
            let b = Mat::from_fn(p, n, |i, k| window.b[i * n + k]);
            let b_inverse = &b * &inverse;
            let eliminated = &b_inverse * b.transpose();
            for i in 0..p {
                right[i] += window.g[i] - (0..n).map(|k| b_inverse[(i, k)] * window.h[k]).sum::<f64>();
                for j in 0..=i {
                    matrix[(i, j)] += window.a[i * p + j] - eliminated[(i, j)];
                }
            }
            state_inverses.push(inverse);
        }
        for i in 0..p {
            for j in 0..i {
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        Some(Self { matrix, right, state_inverses })
    }

    /// Solves (1) for the damped step of the parameters with the indices `moving`; the others are fixed.
    ///
    /// The equations are scaled to a unit diagonal before the damping is added.
    fn solve(&self, moving: &[usize], damping: f64) -> Option<Vec<f64>> {
        if moving.is_empty() {
            return Some(Vec::new());
        }
        let size = |i: usize| self.matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        let scaled = Mat::from_fn(moving.len(), moving.len(), |i, j| {
            let (a, b) = (moving[i], moving[j]);
            self.matrix[(a, b)] / (size(a) * size(b)) + if i == j { damping + RIDGE } else { 0.0 }
        });
        let right = Mat::from_fn(moving.len(), 1, |i, _| self.right[moving[i]] / size(moving[i]));
        let solution = solve_positive_definite(&scaled, &right)?;
        let step: Vec<f64> = (0..moving.len()).map(|i| solution[(i, 0)] / size(moving[i])).collect();
        step.iter().all(|x| x.is_finite()).then_some(step)
    }
}

/// Damped inverse of the curvature C_i in the `n` free initial states of a window; `None` if not positive
/// definite.
fn invert_state_block(window: &WindowEquations, n: usize, damping: f64) -> Option<Mat<f64>> {
    if n == 0 {
        return Some(Mat::zeros(0, 0));
    }
    let c = |i: usize, k: usize| window.c[i.max(k) * n + i.min(k)];
    let largest = (0..n).map(|i| c(i, i)).fold(f64::MIN_POSITIVE, f64::max);
    // The diagonal of a state about which the window carries no information is 0: it takes a share of the
    // largest.
    let size = |i: usize| c(i, i).max(RIDGE * largest).sqrt();
    let scaled = Mat::from_fn(n, n, |i, k| {
        c(i, k) / (size(i) * size(k)) + if i == k { damping + STATE_RIDGE } else { 0.0 }
    });
    let unit = Mat::<f64>::identity(n, n);
    let inverse = solve_positive_definite(&scaled, &unit)?;
    Some(Mat::from_fn(n, n, |i, k| inverse[(i, k)] / (size(i) * size(k))))
}

#[cfg(test)]
mod tests {
    //! Contract: fits in common batches equal, bit for bit, the fits alone; one that fails does not affect
    //! the others.
    use super::*;
    use augsim_equations::{EquationSystem, model};
    use augsim_system::{Prepare, Record};

    /// System and records of an exponential decay, measured with small errors, in windows of 1 s.
    fn decay_problem() -> (EquationSystem, Vec<Record>) {
        let text = "scenario = \"system\"\n[states]\nx_m = { start = \"y_m\" }\n[parameters]\n\
                    rate_per_s = { nominal = 0.3, min = 0.0, max = 10.0 }\n[rates]\nx_m = \"-rate_per_s * x_m\"\n\
                    [outputs]\ny_m = { value = \"x_m\", sd = \"estimate\" }\n";
        let model = model::parse(text, "decay.toml").unwrap();
        let system = EquationSystem::declared_only(&model).unwrap().with_windows(Some(1.0));
        let times: Vec<f64> = (0..101).map(|k| 0.1 * f64::from(k)).collect();
        let error = |k: usize| 0.02 * ((7 * k % 11) as f64 - 5.0) / 5.0;
        let values = times.iter().enumerate().map(|(k, t)| (-0.4 * t).exp() + error(k)).collect();
        let mut record = Record { id: "1".into(), times, values: vec![values], ..Record::default() };
        system.prepare(&mut record, &[]).unwrap();
        (system, vec![record])
    }

    #[test]
    fn batched_fits_equal_single_fits() {
        let (system, records) = decay_problem();
        let problem = Problem::new(&system, &records, true);
        let (windows, scales) = (problem.prepared_windows(), problem.channel_sd());
        assert_eq!(windows.len(), 10);
        let values = [[0.1], [f64::NAN], [0.7], [5.0]];
        let starts: Vec<StartingPoint<'_>> = values
            .iter()
            .map(|values| StartingPoint { values, windows: &windows, scales: &scales })
            .collect();
        let batched = problem.fit_each(&starts, FINAL_TOLERANCE);
        assert!(batched[1].is_err());
        for (start, fit) in starts.iter().zip(&batched) {
            match (problem.fit(start, FINAL_TOLERANCE), fit) {
                (Ok(alone), Ok(fit)) => {
                    assert_eq!((&alone.values, alone.steps), (&fit.values, fit.steps));
                    assert_eq!(alone.scales, fit.scales);
                    assert!((alone.values[0] - 0.4).abs() < 0.05, "{}", alone.values[0]);
                }
                (Err(_), Err(_)) => {}
                (alone, fit) => panic!("alone: {alone:?}, batched: {fit:?}"),
            }
        }
    }
}
