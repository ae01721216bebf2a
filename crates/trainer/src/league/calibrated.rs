//! The honest lower bound of any stochastic claim: physics whose parameters are fitted by least squares, with a scatter that grows with
//! the way moved.
//!
//! The error of state column j at a sample is normal with variance a_j + b_j W^2, where W is the way that the fitted physics has moved
//! so far (m; for a push with c times the angle turned). One draw of the part that grows is held over the trajectory, since a wrong
//! friction stays wrong; the other part is drawn at each sample.

use super::{Class, Fitted, Kind, Plan, Trained};
use crate::league::reads::Reads;
use crate::push::calibrate::calibrate;
use crate::score::length;
use crate::settings::Settings;
use crate::{Engine, Samples, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::model::ModelFile;
use augsim_physics::push::{C, CONTACT_FRICTION, ROD_RADIUS};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::Arc;

pub(crate) static CALIBRATED: Class = Class {
    kind: Kind::Fitted(|settings| {
        Ok(Arc::new(Calibrated {
            free: free(&settings.engine).len(),
            states: settings.engine.columns().len(),
        }))
    }),
    reads: Reads::Sequences,
    plan: Plan { hidden: 1, sd_floor: 0.0, learning_rate: 1.0 },
    pushing_only: false,
};

/// Most trajectories that the parameters are fitted to, evenly spread: three parameters need no more.
const MOST: usize = 400;
/// Points of the grid along each parameter, and rounds over the parameters.
const GRID: usize = 24;
const ROUNDS: usize = 2;
/// Steps of the golden section around the best point of a grid.
const NARROWINGS: usize = 16;
/// Steps of the simplex for each parameter.
const SIMPLEX_STEPS: usize = 30;
/// Rounds of weighted least squares for the scatter.
const REWEIGHTINGS: usize = 8;

/// The numbers of free parameters and of state columns.
#[derive(Debug)]
struct Calibrated {
    free: usize,
    states: usize,
}

/// A parameter that may be fitted: bounds.
type Bounds = [f64; 2];

/// The free parameters of an engine.
fn free(engine: &Engine) -> Vec<Bounds> {
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

fn model_of(engine: &Engine) -> Option<ModelFile> {
    ModelFile::parse(engine.model()?, "model of the run").ok()
}

/// The engine with its free parameters at `values`.
fn engine_at(engine: &Engine, values: &[f64]) -> Result<Engine, TrainerError> {
    let foreign = |_| TrainerError::from(crate::Difference::OtherSystem);
    match (engine, model_of(engine)) {
        (Engine::PybulletBall(ball), _) => {
            Ok(Engine::PybulletBall(BulletBall { restitution: values[0], damping: values[1], ..*ball }))
        }
        (_, Some(ModelFile::Push(mut model))) => {
            for (place, value) in [C, CONTACT_FRICTION, ROD_RADIUS].into_iter().zip(values) {
                model.parameters[place].nominal = *value;
            }
            engine.with_model(&ModelFile::Push(model)).map_err(foreign)
        }
        (_, Some(ModelFile::Ball(mut model))) => {
            let free = model.parameters.iter_mut().filter(|p| !p.frozen);
            free.zip(values).for_each(|(p, v)| p.nominal = *v);
            engine.with_model(&ModelFile::Ball(model)).map_err(foreign)
        }
        (_, None) => Ok(engine.clone()),
    }
}

/// Mean over samples of the squared errors of roll-outs, each column in units of its spread `sd`.
fn squares(engine: &Engine, train: &Sequences, sd: &[f64]) -> f64 {
    let one = |q: &crate::Sequence| -> f64 {
        let path = engine.rollout(q.state(0), &q.actions, q.time);
        let s = sd.len();
        let errors = path.iter().zip(&q.states).enumerate();
        let sum: f64 = errors.map(|(i, (a, b))| ((a - b) / sd[i % s]).powi(2)).sum();
        sum / path.len() as f64
    };
    let all: Vec<f64> = train.items.par_iter().map(one).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    if mean.is_finite() { mean } else { f64::INFINITY }
}

/// Standard deviation of each state column over a set.
fn spreads(train: &Sequences) -> Vec<f64> {
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

/// Least squares by a grid along each parameter in turn and a golden section around its best point, then by a simplex: errors of a ball
/// after some bounces have many local minima, which gradients do not leave, and a valley where less restitution and less damping
/// look alike, which single parameters do not follow.
fn search(engine: &Engine, train: &Sequences) -> Result<Vec<f64>, TrainerError> {
    let (bounds, sd) = (free(engine), spreads(train));
    let mut best: Vec<f64> = match engine {
        Engine::PybulletBall(ball) => vec![ball.restitution, ball.damping],
        _ => match model_of(engine) {
            Some(ModelFile::Ball(m)) => {
                m.parameters.iter().filter(|p| !p.frozen).map(|p| p.nominal).collect()
            }
            _ => Vec::new(),
        },
    };
    for _ in 0..ROUNDS {
        for k in 0..best.len() {
            let [low, high] = bounds[k];
            let at = |v: f64| -> Result<f64, TrainerError> {
                let mut moved = best.clone();
                moved[k] = v;
                Ok(squares(&engine_at(engine, &moved)?, train, &sd))
            };
            let width = (high - low) / GRID as f64;
            let (mut least, mut place) = (at(best[k])?, best[k]);
            for i in 0..=GRID {
                let v = low + width * i as f64;
                let value = at(v)?;
                if value < least {
                    (least, place) = (value, v);
                }
            }
            let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
            let (mut a, mut b) = ((place - width).max(low), (place + width).min(high));
            for _ in 0..NARROWINGS {
                let (c, d) = (b - golden * (b - a), a + golden * (b - a));
                if at(c)? < at(d)? { b = d } else { a = c }
            }
            let middle = 0.5 * (a + b);
            best[k] = if at(middle)? < least { middle } else { place };
        }
    }
    let width = bounds.iter().map(|[low, high]| 0.5 * (high - low) / GRID as f64).collect::<Vec<f64>>();
    simplex(best, &width, &mut |values| {
        let inside = values.iter().zip(&bounds).all(|(v, [low, high])| (low..=high).contains(&v));
        match inside {
            true => Ok(squares(&engine_at(engine, values)?, train, &sd)),
            false => Ok(f64::INFINITY),
        }
    })
}

/// The least value of a function near `start` by a simplex of the given edges (Nelder and Mead 1965).
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
        let along = |share: f64| -> Vec<f64> {
            centre.iter().zip(&worst).map(|(c, w)| c + share * (c - w)).collect()
        };
        let mut tried = |share: f64| -> Result<(f64, Vec<f64>), TrainerError> {
            let at = along(share);
            Ok((f(&at)?, at))
        };
        let reflected = tried(1.0)?;
        let next = if reflected.0 < corners[0].0 {
            let further = tried(2.0)?;
            if further.0 < reflected.0 { further } else { reflected }
        } else if reflected.0 < corners[n - 1].0 {
            reflected
        } else {
            let nearer = tried(if reflected.0 < corners[n].0 { 0.5 } else { -0.5 })?;
            if nearer.0 < corners[n].0.min(reflected.0) {
                nearer
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

/// Way that a roll-out `[time, S]` has moved at each sample: of the positions in the plane, with `length_m` times the angle turned for a push; of the
/// height for a ball.
fn ways(path: &[f64], states: usize, length_m: Option<f64>) -> Vec<f64> {
    let mut way = 0.0;
    let rows: Vec<&[f64]> = path.chunks_exact(states).collect();
    let mut out = vec![0.0];
    for w in rows.windows(2) {
        let d = |j: usize| w[1][j] - w[0][j];
        way += match length_m {
            Some(c) => d(0).hypot(d(1)) + c * d(2).abs(),
            // Positions come first, then as many velocities.
            None => length((0..states / 2).map(d)),
        };
        out.push(way);
    }
    out
}

/// The variances a and b of errors `(error, way)` that are normal with variance a + b way^2: squared errors regressed on squared ways,
/// weighted by the inverse square of the variance, again and again.
fn scatter(errors: &[(f64, f64)]) -> [f64; 2] {
    let mean = errors.iter().map(|(e, _)| e * e).sum::<f64>() / errors.len().max(1) as f64;
    let far = errors.iter().map(|(_, w)| w * w).sum::<f64>() / errors.len().max(1) as f64;
    let floor = 1e-9 * mean + f64::MIN_POSITIVE;
    let (mut a, mut b) = (0.5 * mean + floor, 0.5 * mean / far.max(1e-12));
    for _ in 0..REWEIGHTINGS {
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
        let every = train.items.len().div_ceil(MOST);
        let items = train.items.iter().step_by(every).cloned().collect();
        let few = Sequences { items, ..train.clone() };
        let mut values = match model_of(engine) {
            Some(ModelFile::Push(model)) => {
                calibrate(&model, &few)?.estimates.into_iter().map(|e| e.value).collect()
            }
            _ => search(engine, &few)?,
        };
        let (fitted, s) = (engine_at(engine, &values)?, self.states);
        let length_m = fitted.pushing().map(crate::engine::ModelPush::c_m);
        let mut errors = vec![Vec::new(); s];
        for q in &few.items {
            let path = fitted.rollout(q.state(0), &q.actions, q.time);
            let ways = ways(&path, s, length_m);
            for (i, (a, b)) in path.iter().zip(&q.states).enumerate().skip(s) {
                errors[i % s].push((b - a, ways[i / s]));
            }
        }
        let laws: Vec<[f64; 2]> = errors.iter().map(|e| scatter(e)).collect();
        let left = squares(&fitted, &few, &spreads(&few));
        values.extend(laws.iter().map(|l| l[0]));
        values.extend(laws.iter().map(|l| l[1]));
        Ok((values, left))
    }

    fn forecast(
        &self,
        Trained { settings, params, .. }: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let values: Vec<f64> = params.values().iter().map(|v| f64::from(*v)).collect();
        let (physics, scatter) = values.split_at(self.free);
        let engine = engine_at(&settings.engine, physics)?;
        let (s, path) = (self.states, engine.rollout(task.start, task.actions, task.time));
        let ways = ways(&path, s, engine.pushing().map(crate::engine::ModelPush::c_m));
        let mut rng = random_stream(settings.seed, "calibrated", task.index);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let held: Vec<f64> = (0..s * samples).map(|_| draw()).collect();
        let mut out = Vec::with_capacity(path.len() * samples);
        for (i, v) in path.iter().enumerate() {
            let (j, way) = (i % s, ways[i / s]);
            let (noise, growth) = (scatter[j].sqrt(), scatter[s + j].sqrt() * way);
            // The start is known.
            let noise = if i < s { 0.0 } else { noise };
            out.extend((0..samples).map(|n| (v + growth * held[j * samples + n] + noise * draw()) as f32));
        }
        Ok(Samples { count: samples, values: out })
    }
}
