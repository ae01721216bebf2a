//! Physics with parameters fitted by least squares, and a noise model.
//!
//! This is the baseline for every stochastic model.
//!
//! 1. x_j(t) = f_j(t) + sqrt(b_j) W(t) xi_j + sqrt(a_j) eps_jt, with f the roll-out of the fitted physics,
//!    xi_j and eps_jt standard normal, and W(t) the path length of the roll-out up to t (m; for a push plus c
//!    times the angle turned).
//! 2. So the error has variance a_j + b_j W^2. xi_j is drawn once per trajectory, because the effect of a
//!    wrong friction persists; eps_jt is drawn per sample.
//! 3. a_j and b_j are fitted by iteratively reweighted least squares of the squared errors on W^2.

use super::{Class, Defaults, Fitted, Kind, Trained};
use crate::engine::ModelPush;
use crate::league::inputs::ClassInputs;
use crate::push::calibrate::calibrate;
use crate::score::length;
use crate::settings::Settings;
use crate::{Engine, Samples, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::model::ModelFile;
use augsim_physics::push::{C_INDEX, CONTACT_FRICTION_INDEX, ROD_RADIUS_INDEX};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::Arc;

pub(crate) static CALIBRATED: Class = Class {
    kind: Kind::Fitted(|settings| {
        Ok(Arc::new(Calibrated {
            free: parameter_bounds(&settings.engine).len(),
            states: settings.engine.columns().len(),
        }))
    }),
    inputs: ClassInputs::Unprepared,
    defaults: Defaults { hidden: 1, sd_floor: 0.0, learning_rate: 1.0 },
    is_pushing_only: false,
};

/// Maximum number of trajectories for the fit, evenly spaced in the set; a few parameters need no more.
const MAX_TRAJECTORIES: usize = 400;
/// Number of grid intervals along each fitted parameter.
const GRID_INTERVALS: usize = 24;
/// Number of rounds of coordinate-wise search over all fitted parameters.
const COORDINATE_ROUNDS: usize = 2;
/// Number of golden-section steps around the best grid point of a parameter.
const GOLDEN_STEPS: usize = 16;
/// Number of iterations of the simplex search per parameter.
const SIMPLEX_STEPS: usize = 30;
/// Number of reweighted least-squares iterations for the noise variances.
const REWEIGHTINGS: usize = 8;

/// The class of calibrated physics: numbers of free parameters and of state columns.
#[derive(Debug)]
struct Calibrated {
    free: usize,
    states: usize,
}

/// Lower and upper bound of a free parameter of the physics.
type Bounds = [f64; 2];

/// Returns the bounds of the free parameters of an engine.
///
/// For a push only their number counts, because `calibrate` has its own bounds.
fn parameter_bounds(engine: &Engine) -> Vec<Bounds> {
    match engine {
        Engine::PybulletBall(_) => vec![[0.0, 1.0], [0.0, 0.2]],
        _ => match model_of(engine) {
            Some(ModelFile::Push(_)) => vec![[0.0; 2]; 3],
            Some(ModelFile::Ball(model)) => {
                model.parameters.iter().filter(|p| !p.frozen).map(|p| [p.min, p.max]).collect()
            }
            None => Vec::new(),
        },
    }
}

/// Model file of an engine; `None` if the engine was not built from one.
fn model_of(engine: &Engine) -> Option<ModelFile> {
    ModelFile::parse(engine.model()?, "model of the run").ok()
}

/// Copies the engine with its free parameters set to `values`.
fn engine_with(engine: &Engine, values: &[f64]) -> Result<Engine, TrainerError> {
    let mismatch = |_| TrainerError::from(crate::Difference::OtherSystem);
    match (engine, model_of(engine)) {
        (Engine::PybulletBall(ball), _) => {
            Ok(Engine::PybulletBall(BulletBall { restitution: values[0], damping: values[1], ..*ball }))
        }
        (_, Some(ModelFile::Push(mut model))) => {
            for (index, value) in [C_INDEX, CONTACT_FRICTION_INDEX, ROD_RADIUS_INDEX].into_iter().zip(values)
            {
                model.parameters[index].nominal = *value;
            }
            engine.with_model(&ModelFile::Push(model)).map_err(mismatch)
        }
        (_, Some(ModelFile::Ball(mut model))) => {
            let free = model.parameters.iter_mut().filter(|p| !p.frozen);
            free.zip(values).for_each(|(p, v)| p.nominal = *v);
            engine.with_model(&ModelFile::Ball(model)).map_err(mismatch)
        }
        (_, None) => Ok(engine.clone()),
    }
}

/// Computes the mean squared error of roll-outs, each column in units of its standard deviation `sd`.
///
/// Infinite if a roll-out diverges.
fn mean_square(engine: &Engine, train: &Sequences, sd: &[f64]) -> f64 {
    let mean_square_of = |q: &crate::Sequence| -> f64 {
        let path = engine.rollout(q.state(0), &q.actions, q.time);
        let s = sd.len();
        let errors = path.iter().zip(&q.states).enumerate();
        let sum: f64 = errors.map(|(i, (a, b))| ((a - b) / sd[i % s]).powi(2)).sum();
        sum / path.len() as f64
    };
    let squares: Vec<f64> = train.items.par_iter().map(mean_square_of).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    if mean.is_finite() { mean } else { f64::INFINITY }
}

/// Computes the standard deviation of each state column over a set.
fn standard_deviations(train: &Sequences) -> Vec<f64> {
    let s = train.state_dim();
    (0..s)
        .map(|j| {
            let values = || train.items.iter().flat_map(|q| q.states.iter().skip(j).step_by(s));
            let n = values().count() as f64;
            let mean = values().sum::<f64>() / n;
            (values().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt().max(1e-9)
        })
        .collect()
}

/// Fits the free parameters of a ball by grid and golden-section search, then by a simplex.
///
/// The squared error of a bouncing ball has many local minima, where gradient methods get stuck, and a narrow
/// valley along which restitution and damping compensate each other, which coordinate-wise search cannot
/// follow.
fn search(engine: &Engine, train: &Sequences) -> Result<Vec<f64>, TrainerError> {
    let (bounds, sd) = (parameter_bounds(engine), standard_deviations(train));
    let mut best: Vec<f64> = match engine {
        Engine::PybulletBall(ball) => vec![ball.restitution, ball.damping],
        _ => match model_of(engine) {
            Some(ModelFile::Ball(m)) => {
                m.parameters.iter().filter(|p| !p.frozen).map(|p| p.nominal).collect()
            }
            _ => Vec::new(),
        },
    };
    for _ in 0..COORDINATE_ROUNDS {
        for k in 0..best.len() {
            let [low, high] = bounds[k];
            let cost = |v: f64| -> Result<f64, TrainerError> {
                let mut values = best.clone();
                values[k] = v;
                Ok(mean_square(&engine_with(engine, &values)?, train, &sd))
            };
            let width = (high - low) / GRID_INTERVALS as f64;
            let (mut least_cost, mut best_value) = (cost(best[k])?, best[k]);
            for i in 0..=GRID_INTERVALS {
                let v = low + width * i as f64;
                let grid_cost = cost(v)?;
                if grid_cost < least_cost {
                    (least_cost, best_value) = (grid_cost, v);
                }
            }
            let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
            let (mut a, mut b) = ((best_value - width).max(low), (best_value + width).min(high));
            for _ in 0..GOLDEN_STEPS {
                let (c, d) = (b - golden * (b - a), a + golden * (b - a));
                if cost(c)? < cost(d)? { b = d } else { a = c }
            }
            let middle = 0.5 * (a + b);
            best[k] = if cost(middle)? < least_cost { middle } else { best_value };
        }
    }
    let edges =
        bounds.iter().map(|[low, high]| 0.5 * (high - low) / GRID_INTERVALS as f64).collect::<Vec<f64>>();
    simplex(best, &edges, &mut |values| {
        let is_inside = values.iter().zip(&bounds).all(|(v, [low, high])| (low..=high).contains(&v));
        match is_inside {
            true => Ok(mean_square(&engine_with(engine, values)?, train, &sd)),
            false => Ok(f64::INFINITY),
        }
    })
}

/// Minimises a function from `start` by a simplex with the given edge lengths (Nelder and Mead 1965).
fn simplex(
    start: Vec<f64>,
    edges: &[f64],
    f: &mut dyn FnMut(&[f64]) -> Result<f64, TrainerError>,
) -> Result<Vec<f64>, TrainerError> {
    let n = start.len();
    let mut corners = vec![(f(&start)?, start.clone())];
    for (k, edge) in edges.iter().enumerate() {
        let mut moved = start.clone();
        moved[k] += edge;
        corners.push((f(&moved)?, moved));
    }
    for _ in 0..SIMPLEX_STEPS * n {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (worst, centre) =
            (corners[n].1.clone(), |k: usize| corners[..n].iter().map(|(_, c)| c[k]).sum::<f64>() / n as f64);
        let centre: Vec<f64> = (0..n).map(centre).collect();
        let mut try_point = |factor: f64| -> Result<(f64, Vec<f64>), TrainerError> {
            let point: Vec<f64> = centre.iter().zip(&worst).map(|(c, w)| c + factor * (c - w)).collect();
            Ok((f(&point)?, point))
        };
        let reflected = try_point(1.0)?;
        let next = if reflected.0 < corners[0].0 {
            let expanded = try_point(2.0)?;
            if expanded.0 < reflected.0 { expanded } else { reflected }
        } else if reflected.0 < corners[n - 1].0 {
            reflected
        } else {
            let contracted = try_point(if reflected.0 < corners[n].0 { 0.5 } else { -0.5 })?;
            if contracted.0 < corners[n].0.min(reflected.0) {
                contracted
            } else {
                let best = corners[0].1.clone();
                for corner in &mut corners[1..] {
                    corner.1.iter_mut().zip(&best).for_each(|(v, b)| *v = 0.5 * (*v + b));
                    corner.0 = f(&corner.1)?;
                }
                continue;
            }
        };
        corners[n] = next;
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(corners.swap_remove(0).1)
}

/// Computes the path length W of a roll-out `[time, S]` up to each sample, m.
///
/// For a push the path of the position plus `length_m` times the angle turned; for a ball the path of its
/// position.
fn path_lengths(path: &[f64], states: usize, length_m: Option<f64>) -> Vec<f64> {
    let mut total = 0.0;
    let rows: Vec<&[f64]> = path.chunks_exact(states).collect();
    let mut out = vec![0.0];
    for pair in rows.windows(2) {
        let d = |j: usize| pair[1][j] - pair[0][j];
        total += match length_m {
            Some(c) => d(0).hypot(d(1)) + c * d(2).abs(),
            // The first half of the columns are positions, the second half velocities.
            None => length((0..states / 2).map(d)),
        };
        out.push(total);
    }
    out
}

/// Fits the variances `[a, b]` of errors with variance a + b W^2, from pairs (error, path length W).
///
/// Squared errors are regressed on W^2 with weights (a + b W^2)^-2, the inverse variance of a squared normal
/// error up to a constant, and the weights are updated in each iteration. Both variances are constrained to
/// be non-negative.
fn noise_variances(errors: &[(f64, f64)]) -> [f64; 2] {
    let mean = errors.iter().map(|(e, _)| e * e).sum::<f64>() / errors.len().max(1) as f64;
    let mean_w2 = errors.iter().map(|(_, w)| w * w).sum::<f64>() / errors.len().max(1) as f64;
    let floor = 1e-9 * mean + f64::MIN_POSITIVE;
    let (mut a, mut b) = (0.5 * mean + floor, 0.5 * mean / mean_w2.max(1e-12));
    for _ in 0..REWEIGHTINGS {
        // Weighted sums of 1, x, x^2, y and x y, of which the normal equations consist.
        let mut m = [0.0; 5];
        for (e, w) in errors {
            let (y, x) = (e * e, w * w);
            let weight = (a + b * x).powi(-2);
            [weight, weight * x, weight * x * x, weight * y, weight * x * y]
                .iter()
                .zip(&mut m)
                .for_each(|(v, m)| *m += v);
        }
        let determinant = m[0] * m[2] - m[1] * m[1];
        if determinant <= 1e-12 * m[0] * m[2] {
            break;
        }
        let (free_a, free_b) =
            ((m[3] * m[2] - m[1] * m[4]) / determinant, (m[0] * m[4] - m[1] * m[3]) / determinant);
        (a, b) = match (free_a > floor, free_b > 0.0) {
            (true, true) => (free_a, free_b),
            (_, true) => (floor, m[4] / m[2]),
            _ => (m[3] / m[0], 0.0),
        };
    }
    [a, b]
}

impl Fitted for Calibrated {
    fn parameters(&self) -> Vec<(&'static str, usize)> {
        vec![("physics", self.free), ("noise_variance", self.states), ("growth_variance", self.states)]
    }

    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError> {
        let engine = &settings.engine;
        let stride = train.items.len().div_ceil(MAX_TRAJECTORIES);
        let items = train.items.iter().step_by(stride).cloned().collect();
        let fit_set = Sequences { items, ..train.clone() };
        let mut values = match model_of(engine) {
            Some(ModelFile::Push(model)) => {
                calibrate(&model, &fit_set)?.estimates.into_iter().map(|e| e.value).collect()
            }
            _ => search(engine, &fit_set)?,
        };
        let (fitted, s) = (engine_with(engine, &values)?, self.states);
        let length_m = fitted.push_model().map(ModelPush::c_m);
        let mut errors = vec![Vec::new(); s];
        for q in &fit_set.items {
            let path = fitted.rollout(q.state(0), &q.actions, q.time);
            let lengths = path_lengths(&path, s, length_m);
            for (i, (a, b)) in path.iter().zip(&q.states).enumerate().skip(s) {
                errors[i % s].push((b - a, lengths[i / s]));
            }
        }
        let variances: Vec<[f64; 2]> = errors.iter().map(|e| noise_variances(e)).collect();
        let residual = mean_square(&fitted, &fit_set, &standard_deviations(&fit_set));
        values.extend(variances.iter().map(|v| v[0]));
        values.extend(variances.iter().map(|v| v[1]));
        Ok((values, residual))
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let (settings, values) = (trained.settings, trained.values());
        let (physics, variances) = values.split_at(self.free);
        let engine = engine_with(&settings.engine, physics)?;
        let (s, path) = (self.states, engine.rollout(task.start, task.actions, task.time));
        let lengths = path_lengths(&path, s, engine.push_model().map(ModelPush::c_m));
        let mut rng = random_stream(settings.seed, "calibrated", task.index);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let persistent: Vec<f64> = (0..s * samples).map(|_| draw()).collect();
        let mut out = Vec::with_capacity(path.len() * samples);
        for (i, v) in path.iter().enumerate() {
            let (j, length) = (i % s, lengths[i / s]);
            let (noise, growth) = (variances[j].sqrt(), variances[s + j].sqrt() * length);
            // The initial state is given, so it has no noise.
            let noise = if i < s { 0.0 } else { noise };
            out.extend(
                (0..samples).map(|n| (v + growth * persistent[j * samples + n] + noise * draw()) as f32),
            );
        }
        Ok(Samples { count: samples, values: out })
    }
}
