//! Gaussian processes for what the contact model leaves of the object's motion (Fazeli, Zapolsky, Drumwright, Rodriguez 2017, for impacts;
//! here for pushing): the residual twist in the frame of the contact, per unit of the rod's travel, as a function of the arm of the rod
//! along and across the side, the direction of its motion, how far the friction cone is used, and its speed.
//!
//! Three independent processes with one length scale an input (ARD) and constant noise, on at most [`POINTS`] strides. The forecast adds
//! the residual to the physics at each stride: the mean alone, or a draw a stride, whose variance is that along the mean path (it costs the
//! square of the points, and samples stay near each other).

use super::strides::{Stride, strides_of, touching_share};
use super::{Class, Fitted, Kind, Plan, Trained};
use crate::engine::ModelPush;
use crate::league::reads::Reads;
use crate::push::StartFrame;
use crate::push::gp::Homoscedastic;
use crate::settings::Settings;
use crate::{Samples, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use augsim_nn::Params;
use rand::seq::SliceRandom;
use rand_distr::{Distribution, StandardNormal};
use std::sync::{Arc, OnceLock};

/// Most strides that the processes stand on.
const POINTS: usize = 400;
/// Inputs, and outputs.
const INPUTS: usize = 5;
const OUTPUTS: usize = 3;
/// Least spread of an input, in units of c, rad and e-folds: below it what differs is rounding.
const LEAST: f64 = 1e-2;
/// Logarithms of a kernel.
const KERNEL: usize = INPUTS + 2;

const fn class(make: fn(&Settings) -> Result<Arc<dyn Fitted>, TrainerError>) -> Class {
    Class {
        kind: Kind::Fitted(make),
        reads: Reads::Sequences,
        plan: Plan { hidden: 1, sd_floor: 0.0, learning_rate: 1.0 },
        pushing_only: true,
    }
}

pub(crate) static GP_RESIDUAL: Class =
    class(|_| Ok(Arc::new(GpResidual { drawn: true, built: OnceLock::new() })));
pub(crate) static GP_RESIDUAL_MEAN: Class =
    class(|_| Ok(Arc::new(GpResidual { drawn: false, built: OnceLock::new() })));

#[derive(Debug)]
struct GpResidual {
    /// Whether forecasts are drawn, or the mean propagated.
    drawn: bool,
    /// The processes of the parameters, made by the first forecast: parameters do not change after training.
    built: OnceLock<Option<Processes>>,
}

/// The processes with the scales of their inputs and outputs.
#[derive(Debug)]
struct Processes {
    inputs: [[f64; 2]; INPUTS],
    outputs: [f64; OUTPUTS],
    each: Vec<Homoscedastic<INPUTS>>,
}

/// A stride in training: input and residual.
type Row = ([f64; INPUTS], [f64; OUTPUTS]);

/// A stride as the contact sees it.
struct Look {
    input: [f64; INPUTS],
    /// Angle of the inward normal in the object's frame, rad, and the rod's travel, m.
    normal: f64,
    travel_m: f64,
    /// Displacement that the physics expects, in the object's frame.
    physical: [f64; 3],
}

/// The contact of a stride from a pose; none where the rod does not touch before its end.
fn look(push: &ModelPush, pose: &[f64; 3], stride: &Stride<'_>) -> Option<Look> {
    let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
    let frame = StartFrame::new(pose, 0.0);
    let path = push.follow(pose, &[a, b].concat());
    let (end, instant) = path.last()?;
    let physical = frame.pose(&[end.position[0], end.position[1], end.angle]);
    if physical == [0.0; 3] {
        return None;
    }
    let inward = instant.outward.map(|n| -n);
    let normal = inward[1].atan2(inward[0]);
    let c = push.c_m();
    let (sin, cos) = normal.sin_cos();
    let turned = |v: [f64; 2]| [cos * v[0] + sin * v[1], cos * v[1] - sin * v[0]];
    let travel = frame.vector([b[0] - a[0], b[1] - a[1]]);
    let travel_m = travel[0].hypot(travel[1]);
    let arm = turned(instant.contact);
    let direction = turned(travel);
    let force = turned(frame.vector(instant.force));
    let used = force[1] / (push.contact_friction() * force[0].max(1e-9));
    let speed = travel_m / (b[2] - a[2]).max(1e-6);
    let input = [
        arm[1] / c,
        arm[0] / c,
        direction[1].atan2(direction[0]),
        used.clamp(-1.5, 1.5),
        speed.max(1e-4).ln(),
    ];
    (travel_m > 1e-4).then_some(Look { input, normal, travel_m, physical })
}

/// A vector of the contact's frame in the object's.
fn back(normal: f64, [n, t]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = normal.sin_cos();
    [cos * n - sin * t, sin * n + cos * t]
}

impl Processes {
    fn standard(&self, input: &[f64; INPUTS]) -> [f64; INPUTS] {
        std::array::from_fn(|k| (input[k] - self.inputs[k][0]) / self.inputs[k][1])
    }

    /// Reads the fit from the parameters of a run; `None` if they are none of a fit.
    fn of(values: &[f64]) -> Option<Self> {
        let (head, data) = values.split_at_checked(1 + 2 * INPUTS + OUTPUTS + OUTPUTS * KERNEL)?;
        let count = head[0] as usize;
        let (scales, kernels) = head[1..].split_at(2 * INPUTS + OUTPUTS);
        let rows: Vec<&[f64]> = data.chunks_exact(INPUTS + OUTPUTS).take(count).collect();
        let x: Vec<[f64; INPUTS]> = rows.iter().map(|r| std::array::from_fn(|k| r[k])).collect();
        let each = (0..OUTPUTS).map(|j| {
            let y: Vec<f64> = rows.iter().map(|r| r[INPUTS + j]).collect();
            Homoscedastic::restore(&kernels[j * KERNEL..(j + 1) * KERNEL], &x, &y)
        });
        Some(Processes {
            inputs: std::array::from_fn(|k| [scales[2 * k], scales[2 * k + 1]]),
            outputs: std::array::from_fn(|j| scales[2 * INPUTS + j]),
            each: each.collect::<Option<_>>()?,
        })
    }
}

impl Fitted for GpResidual {
    fn parameters(&self) -> Vec<(&'static str, usize)> {
        vec![
            ("points", 1),
            ("scales", 2 * INPUTS + OUTPUTS),
            ("kernels", OUTPUTS * KERNEL),
            ("data", POINTS * (INPUTS + OUTPUTS)),
        ]
    }

    fn is_deterministic(&self) -> bool {
        !self.drawn
    }

    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError> {
        let few = || TrainerError::Setting {
            key: "train",
            value: format!("{} pushes", train.items.len()),
            rule: "must hold at least 20 strides with contact for a Gaussian process",
        };
        let push = settings.engine.pushing().ok_or_else(few)?;
        let mut rows: Vec<Row> = Vec::new();
        // Every push is looked at until there are ten times as many strides as are kept.
        let every = (train.items.len() / POINTS).max(1);
        for q in train.items.iter().step_by(every) {
            for stride in strides_of(&q.actions) {
                let pose = [0, 1, 2].map(|j| q.state(stride.first)[j]);
                let Some(look) = look(push, &pose, &stride) else { continue };
                let moved = StartFrame::new(&pose, 0.0).pose(q.state(stride.last));
                let left = [0, 1, 2].map(|j| (moved[j] - look.physical[j]) / look.travel_m);
                let [n, t] = back(-look.normal, [left[0], left[1]]);
                rows.push((look.input, [n, t, push.c_m() * left[2]]));
            }
        }
        rows.shuffle(&mut random_stream(settings.seed, "gp-residual", 0));
        rows.truncate(POINTS);
        let n = rows.len() as f64;
        if rows.len() < 20 {
            return Err(few());
        }
        let moments = |of: &dyn Fn(&Row) -> f64| {
            let mean = rows.iter().map(of).sum::<f64>() / n;
            [mean, (rows.iter().map(|r| (of(r) - mean).powi(2)).sum::<f64>() / n).sqrt().max(LEAST)]
        };
        let inputs: [[f64; 2]; INPUTS] = std::array::from_fn(|k| moments(&|r| r.0[k]));
        let outputs: [f64; OUTPUTS] =
            std::array::from_fn(|j| (rows.iter().map(|r| r.1[j] * r.1[j]).sum::<f64>() / n).sqrt().max(1e-9));
        // Kept in single precision: what is fitted must be what is restored.
        let single = |v: f64| f64::from(v as f32);
        let x: Vec<[f64; INPUTS]> = (rows.iter())
            .map(|r| std::array::from_fn(|k| single((r.0[k] - inputs[k][0]) / inputs[k][1])))
            .collect();
        let y: Vec<[f64; OUTPUTS]> =
            rows.iter().map(|r| std::array::from_fn(|j| single(r.1[j] / outputs[j]))).collect();
        let mut values = vec![n];
        values.extend(inputs.iter().flatten());
        values.extend(outputs);
        let mut left = 0.0;
        for j in 0..OUTPUTS {
            let targets: Vec<f64> = y.iter().map(|y| y[j]).collect();
            let process = Homoscedastic::fit(&x, &targets).ok_or_else(few)?;
            left += (x.iter().zip(&targets)).map(|(x, y)| (process.mean(x) - y).powi(2)).sum::<f64>() / n;
            values.extend(process.logarithms());
        }
        for (x, y) in x.iter().zip(&y) {
            values.extend(x);
            values.extend(y);
        }
        values.resize(self.parameters().iter().map(|p| p.1).sum(), 0.0);
        Ok((values, left))
    }

    fn forecast(
        &self,
        Trained { settings, params, .. }: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let built = self.built.get_or_init(|| Processes::of(&wide(params)));
        let (Some(processes), Some(push)) = (built, settings.engine.pushing()) else {
            return Err(crate::Difference::Unfinished.into());
        };
        let mut rng = random_stream(settings.seed, "gp-residual", 1 + task.index);
        let start = [task.start[0], task.start[1], task.start[2]];
        // Lane 0 is the mean path.
        let lanes = if self.drawn { samples + 1 } else { 1 };
        let mut now = vec![start; lanes];
        let mut values = vec![0.0_f32; task.time * 3 * samples];
        (0..3).for_each(|j| values[j * samples..][..samples].fill(start[j] as f32));
        for stride in strides_of(task.actions) {
            let mut sd = [0.0; OUTPUTS];
            for (lane, now) in now.iter_mut().enumerate() {
                let pose = *now;
                let moved = match look(push, &pose, &stride) {
                    None => [0.0; 3],
                    Some(look) => {
                        let x = processes.standard(&look.input);
                        if lane == 0 && self.drawn {
                            sd = std::array::from_fn(|j| processes.each[j].variance(&x).max(0.0).sqrt());
                        }
                        let left: [f64; OUTPUTS] = std::array::from_fn(|j| {
                            let noise: f64 = if lane == 0 { 0.0 } else { StandardNormal.sample(&mut rng) };
                            processes.outputs[j]
                                * (processes.each[j].mean(&x) + sd[j] * noise)
                                * look.travel_m
                        });
                        let [x, y] = back(look.normal, [left[0], left[1]]);
                        [look.physical[0] + x, look.physical[1] + y, look.physical[2] + left[2] / push.c_m()]
                    }
                };
                let next = StartFrame::new(&pose, 0.0).pose_back(moved);
                if lane + 1 > lanes - samples {
                    let sample = lane + samples - lanes;
                    for (t, share) in stride.shares(touching_share(push, &pose, &stride)) {
                        for j in 0..3 {
                            let v = pose[j] + share * (next[j] - pose[j]);
                            values[(t * 3 + j) * samples + sample] = v as f32;
                        }
                    }
                }
                *now = next;
            }
        }
        Ok(Samples { count: samples, values })
    }
}

fn wide(params: &Params<f32>) -> Vec<f64> {
    params.values().iter().map(|v| f64::from(*v)).collect()
}
