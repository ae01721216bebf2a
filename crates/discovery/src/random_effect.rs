//! Random effects per record: whether some parameters vary from record to record, and how widely.
//!
//! Record `i` has its own values, normally distributed about common ones with standard deviation `sd`. With
//! the nuisances eliminated, and linearised about the most probable values of the record, `v` is the
//! gradient and `S` the curvature of half the cost, in the shared parameters and, at the entries `b`, those
//! that vary. The varying ones are integrated out (Laplace approximation; Pinheiro and Bates 1995), the
//! shared ones are profiled out:
//!
//! ```text
//! M = S_bb + phi / sd² I,   V = sum(v - S_.b M^-1 v_b),   T = sum(S - S_.b M^-1 S_b.)
//! -2 ln L = (sum(c - v_b' M^-1 v_b) - V' T^-1 V) / phi + sum(ln det(I + sd² S_bb / phi))
//! ```
//!
//! `sd` and its interval maximise and profile the restricted likelihood, which has the additional term `+
//! ln det T` (Harville 1977). The mean of the draws is a shared parameter: a constant offset is no random
//! effect. The dispersion `phi` is the larger of the differences between windows of one record and the
//! residuals with own values for each record: a model error that changes along a record, or that no value
//! removes, counts as noise.
//!
//! Any other cause that is constant within a record and varies between records with the same signature is
//! not distinguishable.

use crate::addition::Addition;
use crate::evaluate::{Lanes, NormalEquations, Point, assemble_window};
use crate::fit::{ChosenRecords, Fit, assemble_all, fit, fit_nuisance};
use crate::hypothesis::{FreeParameter, Hypothesis};
use crate::linear::{Square, eliminate};
use crate::nuisance_fit::nuisance_step;
use crate::statistics::{chi2_quantile, median};
use augsim_system::{Per, RecordRandomEffect};
use rayon::prelude::*;
use std::ops::Range;

/// Number of Gauss-Newton steps in the estimation of each record's own parameter values.
const NEWTON_STEPS: usize = 4;
/// Minimum number of records for an estimate: a few disturbed records look like the spread of a few.
const MIN_RECORDS: usize = 15;
/// Minimum mean number of windows per record. A record of one window is fitted by its own parameter values
/// whatever effect is missing.
const MIN_WINDOWS_PER_RECORD: usize = 2;

/// Fit in which the parameters that may vary between records have common values for all records. These values
/// include the mean of the random effect.
#[derive(Debug)]
pub(crate) struct CommonFit {
    drawn: RecordRandomEffect,
    hypothesis: Hypothesis,
    theta: Vec<f64>,
    /// Nuisances (initial state, record parameters, event offsets) of each fitted window.
    nuisance: Vec<Vec<f64>>,
    /// Range in theta (the shared parameters) of the entries that vary between records.
    varying: Range<usize>,
}

/// Point in the estimation of a random effect per record: common values, and each record's deviations from
/// them.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Common values of the shared parameters theta.
    theta: Vec<f64>,
    /// Deviations of each record's own values from the common ones, `[record][varying parameter]`.
    own: Vec<Vec<f64>>,
    nuisance: Vec<Vec<f64>>,
    pub normals: Vec<NormalEquations>,
}

/// Quadratic approximation of the cost of one record about its own parameter values. Constant `c`,
/// gradient `v` and curvature `s` are given at the common values.
struct RecordQuadratic {
    c: f64,
    v: Vec<f64>,
    s: Square,
    /// Squared differences between the windows of the record, and their degrees of freedom.
    between_windows: [f64; 2],
    /// Squared residuals at the record's own values, and their degrees of freedom.
    own_residuals: [f64; 2],
}

/// Likelihood of the random effect with the shared parameters profiled out: -2 ln of it and of the restricted
/// likelihood, the step of the shared parameters to their optimum, and their information matrix times the dispersion.
struct Profile {
    profiled: f64,
    restricted: f64,
    step: Vec<f64>,
    information: Square,
}

/// Estimated standard deviation of a random effect per record, with its interval and gain.
#[derive(Debug)]
pub(crate) struct ScatterEstimate {
    pub sd: f64,
    pub ci95: [f64; 2],
    /// Decrease of -2 ln likelihood relative to a model without the random effect.
    pub gain: f64,
    /// Dispersion factor of the cost.
    pub dispersion: f64,
    /// Estimated parameters, with each record at its own values.
    pub state: State,
}

impl CommonFit {
    /// Fits a set of additions with common values of the parameters that may vary between records. `None`
    /// with too few records or windows.
    pub fn with(
        drawn: &RecordRandomEffect,
        sample: &ChosenRecords<'_>,
        from: &Fit,
        additions: &[Addition],
    ) -> Option<Self> {
        let (records, windows) = (sample.chosen.len(), sample.windows().len());
        let has_enough = records >= MIN_RECORDS && windows >= MIN_WINDOWS_PER_RECORD * records;
        if !has_enough && drawn.declared.is_none() {
            return None;
        }
        let through = Addition::effect(&*sample.data.system, drawn.effect, Per::All)?;
        let mut additions = additions.to_vec();
        if drawn.parameters.is_none() && !additions.contains(&through) {
            additions.push(through.clone());
        }
        let mut hypothesis = Hypothesis::new(sample.data, &additions);
        let frozen: Vec<usize> = drawn.parameters.iter().flat_map(|places| places.clone()).collect();
        for (k, index) in frozen.into_iter().enumerate() {
            if hypothesis.entries_of_parameter(index).is_none() {
                let p = &through.parameters()[k];
                hypothesis.free.push(FreeParameter::new(index, p.min, p.max, p.typical));
            }
        }
        let varying = match &drawn.parameters {
            Some(declared) => {
                let entry =
                    |index: usize| hypothesis.entries_of_parameter(index).map(|entries| entries.start);
                entry(declared.start)?..entry(declared.end.checked_sub(1)?)? + 1
            }
            None => hypothesis.entries_of_addition(additions.iter().position(|a| *a == through)?),
        };
        let mut theta = hypothesis.initial_theta(0.0);
        let base = hypothesis.declared_from(&from.hypothesis, &from.theta);
        theta.iter_mut().zip(base).for_each(|(to, value)| *to = value);
        hypothesis.copy_additions(&mut theta, &from.hypothesis, &from.theta);
        let Fit { theta, nuisance, .. } = fit(sample, &hypothesis, &theta, &from.nuisance);
        Some(Self { drawn: drawn.clone(), hypothesis, theta, nuisance, varying })
    }

    /// Order of the derivatives in each window of a sample.
    fn lanes(&self, sample: &ChosenRecords<'_>) -> Vec<Lanes> {
        sample.windows().into_iter().map(|at| Lanes::new(&self.hypothesis, at, &[])).collect()
    }

    /// Evaluates the model with all records at the common values `theta`; the nuisances (initial state,
    /// record parameters, event offsets) are fitted starting from `nuisance`.
    fn common_state(&self, sample: &ChosenRecords<'_>, theta: &[f64], nuisance: &[Vec<f64>]) -> State {
        let fitted = fit_nuisance(sample, &self.hypothesis, theta, nuisance);
        let normals = assemble_all(sample, &self.hypothesis, &self.lanes(sample), theta, &fitted.nuisance);
        let deviations = vec![vec![0.0; self.varying.len()]; sample.chosen.len()];
        State { theta: theta.to_vec(), own: deviations, nuisance: fitted.nuisance, normals }
    }

    /// Estimates the random effect from the records of `sample`; `None` if no variation between records is
    /// most likely.
    pub fn estimate(&self, sample: &ChosenRecords<'_>) -> Option<ScatterEstimate> {
        let least = sample.data.white_share;
        let base = self.common_state(sample, &self.theta, &self.nuisance);
        let mut state = base.clone();
        for _ in 0..NEWTON_STEPS {
            let records = self.quadratics(sample, &state);
            let phi = dispersion(&records, least);
            let sd = most_likely_sd(&self.drawn, |sd| self.profile(&records, sd, phi).restricted)?;
            let shared = self.profile(&records, sd, phi).step;
            state = self.step(sample, &state, &records, &shared, [sd, phi]);
        }
        let records = self.quadratics(sample, &state);
        let phi = dispersion(&records, least);
        let restricted = |sd: f64| self.profile(&records, sd, phi).restricted;
        let sd = most_likely_sd(&self.drawn, restricted)?;
        let none = self.profile(&self.quadratics(sample, &base), 0.0, phi).profiled;
        let value = self.profile(&records, sd, phi).profiled;
        let ci95 = interval(&self.drawn, restricted, sd);
        Some(ScatterEstimate { sd, ci95, gain: none - value, dispersion: phi, state })
    }

    /// Wald statistic of the mean of the random effect: its square in units of its covariance, with one degree of freedom for
    /// each varying parameter.
    pub fn wald_of_mean(&self, sample: &ChosenRecords<'_>, found: &ScatterEstimate) -> f64 {
        let records = self.quadratics(sample, &found.state);
        let covariance = self.profile(&records, found.sd, found.dispersion).information.cholesky().inverse();
        let varying: Vec<usize> = self.varying.clone().collect();
        let mut mean = found.state.theta[self.varying.clone()].to_vec();
        covariance.sub(&varying).cholesky().forward(&mut mean);
        mean.iter().map(|x| x * x).sum::<f64>() / found.dispersion
    }

    /// -2 ln likelihood with the random effect of the most likely standard deviation at a dispersion, about the point `state`.
    pub fn deviance(&self, sample: &ChosenRecords<'_>, state: &State, dispersion: f64) -> f64 {
        let records = self.quadratics(sample, state);
        let profiled = |sd: f64| self.profile(&records, sd, dispersion).profiled;
        profiled(most_likely_sd(&self.drawn, profiled).unwrap_or(0.0))
    }

    /// For each window, its contribution to the cost in the parameters that do not vary between records. Each
    /// entry is (index in the shared parameters, curvature, gradient) of half the cost.
    pub fn parts(
        &self,
        sample: &ChosenRecords<'_>,
        normals: &[NormalEquations],
    ) -> Vec<Vec<(usize, f64, f64)>> {
        let p = self.theta.len();
        let evidence = |(lanes, normal): (&Lanes, &NormalEquations)| {
            let (s, u) = reduced(lanes, normal, p);
            let others = (0..p).filter(|i| !self.varying.contains(i));
            others.map(|i| (i, s.at(i, i), u[i])).collect()
        };
        self.lanes(sample).iter().zip(normals).map(evidence).collect()
    }

    /// Quadratic approximation of the cost of each record at a point of the estimation.
    fn quadratics(&self, sample: &ChosenRecords<'_>, state: &State) -> Vec<RecordQuadratic> {
        let p = self.theta.len();
        let b: Vec<usize> = self.varying.clone().collect();
        let lanes = self.lanes(sample);
        let of_record = |range: Range<usize>, own: &[f64]| {
            let (mut s, mut v, mut c) = (Square::zero(p), vec![0.0; p], 0.0);
            let (mut between, mut freedom, mut misfit, mut count) = (0.0, 0.0, 0.0, 0.0);
            for w in range {
                let normal = &state.normals[w];
                let (sw, mut vw) = reduced(&lanes[w], normal, p);
                c += normal.q;
                for (k, x) in own.iter().enumerate() {
                    c += 2.0 * vw[b[k]] * x;
                    c += own.iter().enumerate().map(|(l, y)| x * sw.at(b[k], b[l]) * y).sum::<f64>();
                }
                for (i, g) in vw.iter_mut().enumerate() {
                    *g += own.iter().enumerate().map(|(k, x)| sw.at(i, b[k]) * x).sum::<f64>();
                }
                let (square, rank) =
                    quadratic_form(&sw.sub(&b), &b.iter().map(|&i| vw[i]).collect::<Vec<_>>());
                between += square;
                freedom += rank;
                misfit += normal.residual_norm_squared;
                count += normal.degrees_of_freedom;
                s.add(1.0, &sw);
                v.iter_mut().zip(&vw).for_each(|(a, x)| *a += x);
            }
            let (square, rank) = quadratic_form(&s.sub(&b), &b.iter().map(|&i| v[i]).collect::<Vec<_>>());
            RecordQuadratic {
                c,
                v,
                s,
                between_windows: [between - square, freedom - rank],
                own_residuals: [misfit, count - rank],
            }
        };
        let all: Vec<_> = sample.windows_by_record().into_iter().zip(&state.own).collect();
        all.into_par_iter().map(|(range, own)| of_record(range, own)).collect()
    }

    /// Matrix M of a record in the formulas of the module: curvature in its own values plus prior precision.
    fn precision(&self, n: &RecordQuadratic, sd: f64, phi: f64) -> Square {
        let b: Vec<usize> = self.varying.clone().collect();
        let mut m = n.s.sub(&b);
        (0..b.len()).for_each(|k| *m.at_mut(k, k) += phi / (sd * sd));
        m
    }

    /// Computes -2 ln likelihood of one record at fixed shared parameters.
    fn deviance_of_record(&self, n: &RecordQuadratic, sd: f64, phi: f64) -> f64 {
        if sd == 0.0 {
            return n.c / phi;
        }
        let m = self.precision(n, sd, phi).cholesky();
        let mut x = n.v[self.varying.clone()].to_vec();
        m.forward(&mut x);
        let fall: f64 = x.iter().map(|x| x * x).sum();
        (n.c - fall) / phi + m.log_det + x.len() as f64 * (sd * sd / phi).ln()
    }

    /// Computes the likelihood with the shared parameters profiled out, for the standard deviation `sd` and
    /// dispersion `phi`.
    fn profile(&self, records: &[RecordQuadratic], sd: f64, phi: f64) -> Profile {
        let p = self.theta.len();
        let b: Vec<usize> = self.varying.clone().collect();
        let (mut t, mut v, mut sum) = (Square::zero(p), vec![0.0; p], 0.0);
        for n in records {
            sum += self.deviance_of_record(n, sd, phi);
            t.add(1.0, &n.s);
            v.iter_mut().zip(&n.v).for_each(|(a, x)| *a += x);
            if sd > 0.0 {
                let m = self.precision(n, sd, phi).cholesky().inverse();
                for (i, v) in v.iter_mut().enumerate() {
                    let along: Vec<f64> = (0..b.len())
                        .map(|k| (0..b.len()).map(|l| n.s.at(i, b[l]) * m.at(l, k)).sum())
                        .collect();
                    *v -= along.iter().zip(&b).map(|(a, &k)| a * n.v[k]).sum::<f64>();
                    for j in 0..p {
                        *t.at_mut(i, j) -= along.iter().zip(&b).map(|(a, &k)| a * n.s.at(k, j)).sum::<f64>();
                    }
                }
            }
        }
        let factor = t.cholesky();
        let mut step = v.clone();
        factor.solve(&mut step);
        factor.forward(&mut v);
        let profiled = sum - v.iter().map(|x| x * x).sum::<f64>() / phi;
        Profile { profiled, restricted: profiled + factor.log_det, step, information: t }
    }

    /// Moves the shared parameters by `shared`, and each record to its most probable values there. Keeps the
    /// shared parameters if the joint cost would rise.
    fn step(
        &self,
        sample: &ChosenRecords<'_>,
        state: &State,
        records: &[RecordQuadratic],
        shared: &[f64],
        scales: [f64; 2],
    ) -> State {
        let cost = |s: &State| {
            let squares = s.own.iter().flatten().map(|x| x * x).sum::<f64>();
            s.normals.iter().map(|n| n.q).sum::<f64>() + scales[1] * squares / (scales[0] * scales[0])
        };
        let moved = self.move_to(sample, state, records, shared, scales);
        if cost(&moved) <= cost(state) || shared.iter().all(|d| *d == 0.0) {
            return moved;
        }
        self.move_to(sample, state, records, &vec![0.0; shared.len()], scales)
    }

    /// Moves the shared parameters by `shared`, and each record to its most probable values there.
    fn move_to(
        &self,
        sample: &ChosenRecords<'_>,
        state: &State,
        records: &[RecordQuadratic],
        shared: &[f64],
        [sd, phi]: [f64; 2],
    ) -> State {
        let h = &self.hypothesis;
        let theta: Vec<f64> = (state.theta.iter().zip(shared).zip(h.fit_bounds()))
            .map(|((t, d), (low, high))| (t + d).clamp(low, high))
            .collect();
        let shared: Vec<f64> = theta.iter().zip(&state.theta).map(|(a, b)| a - b).collect();
        let (windows, lanes) = (sample.windows(), self.lanes(sample));
        // Evaluates the windows of a record at its own values, with their nuisances moved along.
        let evaluate = |range: &Range<usize>, old: &[f64], new: &[f64]| -> (Vec<_>, Vec<_>) {
            let (mut step, mut own) = (shared.clone(), theta.clone());
            for (k, place) in self.varying.clone().enumerate() {
                step[place] += new[k] - old[k];
                own[place] += new[k];
            }
            let one = |w: usize| {
                sample.data.work.count_simulation();
                let nuisance = nuisance_step(&lanes[w], &state.normals[w], &state.nuisance[w], &step, 0.0);
                let point = Point::new(h, &*h.system, &lanes[w], windows[w].record, &own, &nuisance);
                let normal = assemble_window(&point, &lanes[w], windows[w], sample.correlation);
                (nuisance, normal)
            };
            range.clone().map(one).unzip()
        };
        let is_fixed = shared.iter().all(|d| *d == 0.0);
        let all: Vec<_> = sample.windows_by_record().into_iter().zip(&state.own).zip(records).collect();
        let moved: Vec<_> = all
            .into_par_iter()
            .map(|((range, old), n)| {
                let p = theta.len();
                let mut new: Vec<f64> = (self.varying.clone())
                    .map(|row| n.v[row] - (0..p).map(|j| n.s.at(row, j) * shared[j]).sum::<f64>())
                    .collect();
                self.precision(n, sd, phi).cholesky().solve(&mut new);
                let prior = |x: &[f64]| phi * x.iter().map(|x| x * x).sum::<f64>() / (sd * sd);
                let cost = |normals: &[NormalEquations]| normals.iter().map(|n| n.q).sum::<f64>();
                let stay = if is_fixed {
                    (state.nuisance[range.clone()].to_vec(), state.normals[range.clone()].to_vec())
                } else {
                    evaluate(&range, old, old)
                };
                let before = cost(&stay.1) + prior(old);
                for share in [1.0, 0.4, 0.16] {
                    let value: Vec<f64> = old.iter().zip(&new).map(|(a, b)| a + share * (b - a)).collect();
                    let (nuisance, normals) = evaluate(&range, old, &value);
                    if cost(&normals) + prior(&value) < before {
                        return (value, nuisance, normals);
                    }
                }
                (old.clone(), stay.0, stay.1)
            })
            .collect();
        let mut out = State { theta, own: Vec::new(), nuisance: Vec::new(), normals: Vec::new() };
        for (own, nuisance, normals) in moved {
            out.own.push(own);
            out.nuisance.extend(nuisance);
            out.normals.extend(normals);
        }
        out
    }
}

/// Curvature and gradient of a window in all `p` shared parameters, with its nuisances (initial state, record
/// parameters, event offsets) eliminated.
fn reduced(lanes: &Lanes, normal: &NormalEquations, p: usize) -> (Square, Vec<f64>) {
    let (sw, uw, _) = eliminate(&normal.h, &normal.g, lanes.common());
    let (mut s, mut u) = (Square::zero(p), vec![0.0; p]);
    for (a, &i) in lanes.theta.iter().enumerate() {
        u[i] += uw[a];
        for (b, &j) in lanes.theta.iter().enumerate() {
            *s.at_mut(i, j) += sw.at(a, b);
        }
    }
    (s, u)
}

/// Computes `v' S^-1 v` and the rank of the symmetric matrix `s`.
fn quadratic_form(s: &Square, v: &[f64]) -> (f64, f64) {
    let scale: Vec<f64> = (0..s.n).map(|i| s.at(i, i)).collect();
    let scaled = |i: usize, j: usize| s.at(i, j) / (scale[i] * scale[j]).max(1e-300).sqrt();
    let mut unit = Square::zero(s.n);
    (0..s.n).for_each(|i| (0..s.n).for_each(|j| *unit.at_mut(i, j) = scaled(i, j)));
    let rank = unit.eigen().0.iter().filter(|value| **value > 1e-12).count();
    let mut x = v.to_vec();
    s.cholesky().forward(&mut x);
    (x.iter().map(|x| x * x).sum(), rank as f64)
}

/// Dispersion factor `phi` of the cost, at least `least`. It is the larger one of the differences between
/// windows of a record and the residuals at the records' own values, per degree of freedom.
fn dispersion(records: &[RecordQuadratic], least: f64) -> f64 {
    let [between, freedom] = [0, 1].map(|k| records.iter().map(|n| n.between_windows[k]).sum::<f64>());
    let mut residual: Vec<f64> = records
        .iter()
        .filter(|n| n.own_residuals[1] > 0.0)
        .map(|n| n.own_residuals[0] / n.own_residuals[1])
        .collect();
    let within = if freedom > 0.0 { between / freedom } else { 0.0 };
    within.max(median(&mut residual)).max(least)
}

/// Minimum standard deviation of a random effect, in units of its typical one; smaller ones have no practical
/// cause.
const MIN_SD: f64 = 0.02;
/// Number of steps in the grid of standard deviations that are tried, evenly spaced in the logarithm.
const GRID_POINTS: usize = 60;

/// Minimum and maximum standard deviation of a random effect per record.
fn sd_bounds(drawn: &RecordRandomEffect) -> (f64, f64) {
    drawn.scatter.parameters.first().map_or((1e-6, 1.0), |p| (MIN_SD * p.typical, p.max))
}

/// Standard deviation of the random effect that minimises `criterion` (-2 ln likelihood). `None` if it is the
/// smallest one tried.
fn most_likely_sd(drawn: &RecordRandomEffect, criterion: impl Fn(f64) -> f64) -> Option<f64> {
    let (least, most) = sd_bounds(drawn);
    let span = (most / least).ln();
    let grid = (0..=GRID_POINTS).map(|i| least * (span * i as f64 / GRID_POINTS as f64).exp());
    let values: Vec<(f64, f64)> = grid.map(|sd| (criterion(sd), sd)).collect();
    let best = (0..values.len()).min_by(|&a, &b| values[a].0.total_cmp(&values[b].0))?;
    if best == 0 {
        return None;
    }
    let (mut low, mut high) = (values[best - 1].1.ln(), values[(best + 1).min(GRID_POINTS)].1.ln());
    for _ in 0..30 {
        let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
        if criterion(a.exp()) < criterion(b.exp()) { high = b } else { low = a }
    }
    Some((0.5 * (low + high)).exp())
}

/// 95 % interval of the random effect's standard deviation, by the profile likelihood `criterion` about
/// `best`.
fn interval(drawn: &RecordRandomEffect, criterion: impl Fn(f64) -> f64, best: f64) -> [f64; 2] {
    let edge = criterion(best) + chi2_quantile(0.05, 1.0);
    let (least, most) = sd_bounds(drawn);
    [(least, 0.0), (most, most)].map(|(end, bound)| {
        if criterion(end) < edge {
            return bound;
        }
        let (mut inside, mut outside) = (best.ln(), end.ln());
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if criterion(middle.exp()) < edge { inside = middle } else { outside = middle }
        }
        inside.exp()
    })
}
