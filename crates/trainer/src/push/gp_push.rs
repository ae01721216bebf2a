//! Gaussian-process baseline of pushing: predicts one short step, and is rolled out.
//!
//! The step model follows Bauza and Rodriguez (2017), the roll-out the prediction half of GP-SUM (2018).
//! Inputs, in the frame of the contact's normal: the rod's position along the face, its direction of
//! motion, and the logarithm of its speed. Outputs: the object's displacement while the rod travels
//! [`SEGMENT_M`], by three independent processes with input-dependent noise. The fit is tabulated on a grid
//! and interpolated, as in the authors' code; other step lengths scale linearly.
//!
//! A roll-out draws from the predicted Gaussian once per segment and keeps the draw within it, because
//! deviations persist. This is GP-SUM without observations: each of M components is moved to the mean at a
//! sample of the previous belief, with the predicted covariance, at equal weights; one draw from each
//! component is one trajectory here.

use super::gp::Heteroscedastic;
use crate::{Engine, Forecaster, Samples, Sequence, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use augsim_physics::push::planar::{Rotation, Vector, dot, norm, rot90, scale, sub};
use augsim_physics::push::{Pose, World};
use rand::seq::SliceRandom;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Distance that the rod moves in a training step, m.
const SEGMENT_M: f64 = 5e-3;
/// Maximum distance that the rod moves in a step of a roll-out, m.
const STEP_M: f64 = 2.5e-3;
/// Gap up to which rod and object count as touching, m: about twice the measurement noise.
const TOUCH_M: f64 = 7e-4;
/// Number of grid points along each of the three inputs of the table.
const GRID: [usize; 3] = [25, 25, 9];

/// Settings for fitting the Gaussian-process baseline of pushing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GpOptions {
    /// Maximum number of training steps; they are drawn at random from all steps.
    pub steps: usize,
    /// Seed of all random draws.
    pub seed: u64,
}

/// The fitted Gaussian-process model of pushing, tabulated on a grid of its inputs.
#[derive(Debug, Clone)]
pub struct GpPush {
    world: World,
    rod_radius_m: f64,
    seed: u64,
    /// Mean and standard deviation of each input in training, for standardisation.
    inputs: [[f64; 2]; 3],
    /// Lower and upper end of the grid along each input, in standard units.
    bounds: [[f64; 2]; 3],
    /// Mean and standard deviation of the displacement (normal, tangent, angle) at each grid point.
    table: Vec<[[f64; 2]; 3]>,
}

/// A training step of the pushing model: input and displacement, three numbers each.
type TrainingStep = ([f64; 3], [f64; 3]);

/// The contact between rod and object, and the inputs of the Gaussian processes there.
struct Contact {
    input: [f64; 3],
    normal: Vector<f64>,
    gap_m: f64,
    is_closing: bool,
}

impl GpPush {
    /// Fits the Gaussian processes to steps of `train`; of `engine` only outline and rod are used.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if the engine has no rod, or there are fewer than 20 steps with contact.
    pub fn fit(engine: &Engine, train: &Sequences, options: GpOptions) -> Result<Self, TrainerError> {
        let too_few = TrainerError::Setting {
            key: "train",
            value: format!("{} pushes", train.items.len()),
            rule: "must hold at least 20 steps of 5 mm with contact for a Gaussian process",
        };
        let push = engine.push_model().ok_or_else(no_rod)?;
        let mut model = GpPush {
            world: push.world().clone(),
            rod_radius_m: push.rod_radius_m(),
            seed: options.seed,
            inputs: [[0.0, 1.0]; 3],
            bounds: [[0.0; 2]; 3],
            table: Vec::new(),
        };
        let mut steps: Vec<TrainingStep> = train.items.iter().flat_map(|q| model.steps(q)).collect();
        steps.shuffle(&mut random_stream(options.seed, "gp-steps", 0));
        steps.truncate(options.steps);
        if steps.len() < 20 {
            return Err(too_few);
        }
        let n = steps.len() as f64;
        let moments = |component: &dyn Fn(&TrainingStep) -> f64| {
            let mean = steps.iter().map(component).sum::<f64>() / n;
            let square = steps.iter().map(|s| (component(s) - mean).powi(2)).sum::<f64>() / n;
            [mean, square.sqrt().max(1e-9)]
        };
        model.inputs = [0, 1, 2].map(|j| moments(&|s| s.0[j]));
        let outputs = [0, 1, 2].map(|j| moments(&|s| s.1[j]));
        let x: Vec<[f64; 3]> = steps.iter().map(|s| model.standard(s.0)).collect();
        model.bounds = [0, 1, 2].map(|j| {
            let values = || x.iter().map(|x| x[j]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        });
        let fits: Vec<Option<Heteroscedastic<3>>> = (0..3_usize)
            .into_par_iter()
            .map(|j| {
                let y: Vec<f64> = steps.iter().map(|s| (s.1[j] - outputs[j][0]) / outputs[j][1]).collect();
                Heteroscedastic::fit(&x, &y)
            })
            .collect();
        let fits: Vec<Heteroscedastic<3>> = fits.into_iter().collect::<Option<_>>().ok_or(too_few)?;
        let points = GRID.iter().product::<usize>();
        model.table = (0..points)
            .into_par_iter()
            .map(|point| {
                let index = [point / (GRID[1] * GRID[2]), point / GRID[2] % GRID[1], point % GRID[2]];
                let x = [0, 1, 2].map(|j| {
                    let [low, high] = model.bounds[j];
                    low + (high - low) * index[j] as f64 / (GRID[j] - 1) as f64
                });
                [0, 1, 2].map(|j| {
                    let (mean, variance) = fits[j].predict(&x);
                    [outputs[j][0] + outputs[j][1] * mean, outputs[j][1] * variance.sqrt()]
                })
            })
            .collect();
        Ok(model)
    }

    /// Copies the fitted model for another object, whose outline decides where the rod touches.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if the engine has no rod.
    pub fn with_engine(&self, engine: &Engine) -> Result<Self, TrainerError> {
        let push = engine.push_model().ok_or_else(no_rod)?;
        Ok(GpPush { world: push.world().clone(), rod_radius_m: push.rod_radius_m(), ..self.clone() })
    }

    fn standard(&self, x: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|j| (x[j] - self.inputs[j][0]) / self.inputs[j][1])
    }

    /// Computes the contact of a rod at position `rod` that moves by `travel` in `interval` seconds.
    fn contact(&self, pose: &[f64; 3], rod: Vector<f64>, travel: Vector<f64>, interval: f64) -> Contact {
        let object = Pose::new(pose[0], pose[1], pose[2]);
        let local = object.to_body(rod);
        let nearest = self.world.object().outline.nearest(local);
        let normal = Rotation::new(pose[2]).to_world(nearest.outward.map(|n| -n));
        let along = dot(sub(rod, object.position), rot90(normal));
        let (u_n, u_t) = (dot(travel, normal), dot(travel, rot90(normal)));
        let speed = norm(travel) / interval.max(1e-6);
        Contact {
            input: [along, u_t.atan2(u_n), speed.max(1e-4).ln()],
            normal,
            gap_m: nearest.distance - self.rod_radius_m,
            is_closing: u_n > 0.0,
        }
    }

    /// Extracts inputs and displacements of steps of about [`SEGMENT_M`] that begin in contact.
    /// Displacements are scaled to that distance.
    fn steps(&self, q: &Sequence) -> Vec<TrainingStep> {
        let rod = |t: usize| [q.action(t)[0], q.action(t)[1]];
        let mut out = Vec::new();
        let mut start = 0;
        for t in 1..q.time {
            let travel = sub(rod(t), rod(start));
            let length = norm(travel);
            if length < SEGMENT_M * 0.8 {
                continue;
            }
            let (a, b) = (q.state(start), q.state(t));
            let interval = q.action(t)[2] - q.action(start)[2];
            let contact = self.contact(&[a[0], a[1], a[2]], rod(start), travel, interval);
            start = t;
            if contact.gap_m > TOUCH_M || !contact.is_closing {
                continue;
            }
            let moved = [b[0] - a[0], b[1] - a[1]];
            let k = SEGMENT_M / length;
            let displacement =
                [k * dot(moved, contact.normal), k * dot(moved, rot90(contact.normal)), k * (b[2] - a[2])];
            out.push((contact.input, displacement));
        }
        out
    }

    /// Mean and standard deviation of the displacement at an input, by trilinear interpolation.
    fn look_up(&self, input: [f64; 3]) -> [[f64; 2]; 3] {
        let x = self.standard(input);
        let mut cell = [(0, 0.0); 3];
        for j in 0..3 {
            let [low, high] = self.bounds[j];
            let position = ((x[j] - low) / (high - low).max(1e-12)).clamp(0.0, 1.0) * (GRID[j] - 1) as f64;
            let lower = (position.floor() as usize).min(GRID[j] - 2);
            cell[j] = (lower, position - lower as f64);
        }
        let mut out = [[0.0; 2]; 3];
        for corner in 0..8_usize {
            let (mut weight, mut index) = (1.0, 0);
            for (j, (lower, share)) in cell.iter().enumerate() {
                let up = corner >> j & 1;
                weight *= if up == 1 { *share } else { 1.0 - share };
                index = index * GRID[j] + lower + up;
            }
            for (o, v) in out.iter_mut().zip(&self.table[index]) {
                (0..2).for_each(|k| o[k] += weight * v[k]);
            }
        }
        out
    }

    fn roll(&self, task: Task<'_>, sample: usize, mut visit: impl FnMut(usize, [f64; 3])) {
        let mut rng = random_stream(self.seed, "gp-sum", task.index << 32 | sample as u64);
        let mut draw = || [0, 1, 2].map(|_| -> f64 { StandardNormal.sample(&mut rng) });
        let mut pose = [task.start[0], task.start[1], task.start[2]];
        visit(0, pose);
        let (mut noise, mut travelled) = (draw(), 0.0);
        for t in 1..task.time {
            let [a, b] = [t - 1, t].map(|t| &task.actions[3 * t..3 * t + 3]);
            let (interval, travel) = (b[2] - a[2], [b[0] - a[0], b[1] - a[1]]);
            // A travel of a whole number of steps up to rounding counts as that number.
            let count = (norm(travel) / STEP_M - 1e-6).ceil().max(0.0);
            for i in 0..count as usize {
                let (share, offset) = (1.0 / count, i as f64 / count);
                let (step, rod) =
                    (scale(travel, share), [a[0] + offset * travel[0], a[1] + offset * travel[1]]);
                let contact = self.contact(&pose, rod, step, interval * share);
                if contact.gap_m > TOUCH_M || !contact.is_closing {
                    continue;
                }
                let length = norm(step);
                travelled += length;
                if travelled > SEGMENT_M * (1.0 + 1e-6) {
                    (travelled, noise) = (length, draw());
                }
                let moved = self.look_up(contact.input);
                let k = length / SEGMENT_M;
                let displacement = [0, 1, 2].map(|j| k * (moved[j][0] + moved[j][1] * noise[j]));
                let (n, side) = (contact.normal, rot90(contact.normal));
                pose[0] += displacement[0] * n[0] + displacement[1] * side[0];
                pose[1] += displacement[0] * n[1] + displacement[1] * side[1];
                pose[2] += displacement[2];
            }
            visit(t, pose);
        }
    }
}

fn no_rod() -> TrainerError {
    let rule = "must be the model of a rod that pushes an object";
    TrainerError::Setting { key: "engine", value: "an engine without a rod".to_owned(), rule }
}

impl Forecaster for GpPush {
    fn name(&self) -> &str {
        "GP"
    }

    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
        let mut values = vec![0.0; task.time * 3 * samples];
        for sample in 0..samples {
            self.roll(task, sample, |t, pose| {
                for (j, v) in pose.into_iter().enumerate() {
                    values[(t * 3 + j) * samples + sample] = v as f32;
                }
            });
        }
        Ok(Samples { count: samples, values })
    }
}
