//! Gaussian processes for the residual (actual - predicted motion) of the contact model of pushing.
//!
//! Fazeli, Zapolsky, Drumwright, Rodriguez 2017, for impacts; here for pushing.
//!
//! The target is the residual twist in the frame of the contact, per unit of the rod's travel. The inputs are
//! the coordinates of the contact point along and across the side, the direction of the rod's motion, the
//! used fraction of the friction cone, and the logarithm of the rod's speed.
//!
//! Three independent processes with one length scale per input (ARD) and constant noise, on at most
//! [`MAX_POINTS`] strides. The forecast adds the residual to the physics at each stride: its mean, or a
//! random draw. The variance of the draws is evaluated only along the mean path, because it costs O(points^2)
//! and the samples stay close to each other.

use super::strides::{Stride, split_into_strides, travel_before_contact};
use super::{Class, Defaults, Fitted, Kind, Trained};
use crate::engine::ModelPush;
use crate::league::inputs::ClassInputs;
use crate::push::StartFrame;
use crate::push::gp::Homoscedastic;
use crate::settings::Settings;
use crate::{Samples, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use rand::seq::SliceRandom;
use rand_distr::{Distribution, StandardNormal};
use std::sync::{Arc, OnceLock};

/// Maximum number of strides (short motions of the rod) on which the Gaussian processes are trained.
const MAX_POINTS: usize = 400;
/// Number of inputs of each Gaussian process.
const INPUTS: usize = 5;
/// Number of outputs (residual displacements), each with its own Gaussian process.
const OUTPUTS: usize = 3;
/// Lower bound of the standard deviation of an input; smaller values are rounding errors.
///
/// In units of c, rad or ln speed.
const MIN_INPUT_SD: f64 = 1e-2;
/// Number of hyperparameters of a kernel, stored as logarithms.
const KERNEL: usize = INPUTS + 2;

const fn class(make: fn(&Settings) -> Result<Arc<dyn Fitted>, TrainerError>) -> Class {
    Class {
        kind: Kind::Fitted(make),
        inputs: ClassInputs::Unprepared,
        defaults: Defaults { hidden: 1, sd_floor: 0.0, learning_rate: 1.0 },
        is_pushing_only: true,
    }
}

pub(crate) static GP_RESIDUAL: Class =
    class(|_| Ok(Arc::new(GpResidual { is_sampled: true, processes: OnceLock::new() })));
pub(crate) static GP_RESIDUAL_MEAN: Class =
    class(|_| Ok(Arc::new(GpResidual { is_sampled: false, processes: OnceLock::new() })));

#[derive(Debug)]
struct GpResidual {
    /// Whether forecasts sample the residual; otherwise they use its mean.
    is_sampled: bool,
    /// Gaussian processes, built from the parameters by the first forecast.
    ///
    /// The parameters do not change after training.
    processes: OnceLock<Option<Processes>>,
}

/// The Gaussian processes, one per output, with the scales of inputs and outputs.
#[derive(Debug)]
struct Processes {
    /// Mean and standard deviation of each input, for standardisation.
    inputs: [[f64; 2]; INPUTS],
    /// Root mean square of each output, by which it is divided.
    outputs: [f64; OUTPUTS],
    per_output: Vec<Homoscedastic<INPUTS>>,
}

/// Inputs and targets of a stride on which the Gaussian processes are trained.
type Row = ([f64; INPUTS], [f64; OUTPUTS]);

/// Inputs and physics prediction of a stride (short motion of the rod) with contact.
struct ContactStride {
    input: [f64; INPUTS],
    /// Angle of the inward contact normal in the object's frame, rad.
    normal: f64,
    /// Distance that the rod moves in the stride, m.
    travel_m: f64,
    /// Displacement of the object that the physics predicts, in the object's frame (m, m, rad).
    physical: [f64; 3],
}

/// Computes inputs and physics prediction of a stride; `None` if the rod does not touch the object.
fn contact_stride(push: &ModelPush, pose: &[f64; 3], stride: &Stride<'_>) -> Option<ContactStride> {
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
    let to_contact_frame = |v: [f64; 2]| [cos * v[0] + sin * v[1], cos * v[1] - sin * v[0]];
    let travel = frame.vector([b[0] - a[0], b[1] - a[1]]);
    let travel_m = travel[0].hypot(travel[1]);
    let arm = to_contact_frame(instant.contact);
    let direction = to_contact_frame(travel);
    let force = to_contact_frame(frame.vector(instant.force));
    let cone_fraction = force[1] / (push.contact_friction() * force[0].max(1e-9));
    let speed = travel_m / (b[2] - a[2]).max(1e-6);
    let input = [
        arm[1] / c,
        arm[0] / c,
        direction[1].atan2(direction[0]),
        cone_fraction.clamp(-1.5, 1.5),
        speed.max(1e-4).ln(),
    ];
    (travel_m > 1e-4).then_some(ContactStride { input, normal, travel_m, physical })
}

/// Rotates a vector from the frame of the contact normal to the object's frame.
fn to_object_frame(normal: f64, [n, t]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = normal.sin_cos();
    [cos * n - sin * t, sin * n + cos * t]
}

impl Processes {
    /// Converts an input of the Gaussian processes to standard units.
    fn standardise(&self, input: &[f64; INPUTS]) -> [f64; INPUTS] {
        std::array::from_fn(|k| (input[k] - self.inputs[k][0]) / self.inputs[k][1])
    }

    /// Rebuilds the Gaussian processes from the parameters of a run; `None` if these do not come from a fit.
    fn restore(values: &[f64]) -> Option<Self> {
        let (hyperparameters, data) = values.split_at_checked(1 + 2 * INPUTS + OUTPUTS + OUTPUTS * KERNEL)?;
        let count = hyperparameters[0] as usize;
        let (scales, kernels) = hyperparameters[1..].split_at(2 * INPUTS + OUTPUTS);
        let rows: Vec<&[f64]> = data.chunks_exact(INPUTS + OUTPUTS).take(count).collect();
        let x: Vec<[f64; INPUTS]> = rows.iter().map(|r| std::array::from_fn(|k| r[k])).collect();
        let per_output = (0..OUTPUTS).map(|j| {
            let y: Vec<f64> = rows.iter().map(|r| r[INPUTS + j]).collect();
            Homoscedastic::restore(&kernels[j * KERNEL..(j + 1) * KERNEL], &x, &y)
        });
        Some(Processes {
            inputs: std::array::from_fn(|k| [scales[2 * k], scales[2 * k + 1]]),
            outputs: std::array::from_fn(|j| scales[2 * INPUTS + j]),
            per_output: per_output.collect::<Option<_>>()?,
        })
    }
}

impl Fitted for GpResidual {
    fn parameters(&self) -> Vec<(&'static str, usize)> {
        vec![
            ("points", 1),
            ("scales", 2 * INPUTS + OUTPUTS),
            ("kernels", OUTPUTS * KERNEL),
            ("data", MAX_POINTS * (INPUTS + OUTPUTS)),
        ]
    }

    fn is_deterministic(&self) -> bool {
        !self.is_sampled
    }

    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError> {
        let too_few = || TrainerError::Setting {
            key: "train",
            value: format!("{} pushes", train.items.len()),
            rule: "must contain at least 20 strides with contact to fit a Gaussian process",
        };
        let push = settings.engine.push_model().ok_or_else(too_few)?;
        let mut rows: Vec<Row> = Vec::new();
        // Large sets are thinned to about MAX_POINTS pushes, each of which has several strides.
        let spacing = (train.items.len() / MAX_POINTS).max(1);
        for q in train.items.iter().step_by(spacing) {
            for stride in split_into_strides(&q.actions) {
                let pose = [0, 1, 2].map(|j| q.state(stride.first)[j]);
                let Some(contact) = contact_stride(push, &pose, &stride) else { continue };
                let displacement = StartFrame::new(&pose, 0.0).pose(q.state(stride.last));
                let residual = [0, 1, 2].map(|j| (displacement[j] - contact.physical[j]) / contact.travel_m);
                // The inverse rotation, into the contact frame.
                let [normal, tangent] = to_object_frame(-contact.normal, [residual[0], residual[1]]);
                rows.push((contact.input, [normal, tangent, push.c_m() * residual[2]]));
            }
        }
        rows.shuffle(&mut random_stream(settings.seed, "gp-residual", 0));
        rows.truncate(MAX_POINTS);
        let n = rows.len() as f64;
        if rows.len() < 20 {
            return Err(too_few());
        }
        let moments = |value: &dyn Fn(&Row) -> f64| {
            let mean = rows.iter().map(value).sum::<f64>() / n;
            [mean, (rows.iter().map(|r| (value(r) - mean).powi(2)).sum::<f64>() / n).sqrt().max(MIN_INPUT_SD)]
        };
        let inputs: [[f64; 2]; INPUTS] = std::array::from_fn(|k| moments(&|r| r.0[k]));
        let outputs: [f64; OUTPUTS] =
            std::array::from_fn(|j| (rows.iter().map(|r| r.1[j] * r.1[j]).sum::<f64>() / n).sqrt().max(1e-9));
        // Parameters are stored in single precision, so the fit must use the rounded data as well.
        let round = |v: f64| f64::from(v as f32);
        let x: Vec<[f64; INPUTS]> = (rows.iter())
            .map(|r| std::array::from_fn(|k| round((r.0[k] - inputs[k][0]) / inputs[k][1])))
            .collect();
        let y: Vec<[f64; OUTPUTS]> =
            rows.iter().map(|r| std::array::from_fn(|j| round(r.1[j] / outputs[j]))).collect();
        let mut values = vec![n];
        values.extend(inputs.iter().flatten());
        values.extend(outputs);
        let mut mean_square = 0.0;
        for j in 0..OUTPUTS {
            let targets: Vec<f64> = y.iter().map(|y| y[j]).collect();
            let process = Homoscedastic::fit(&x, &targets).ok_or_else(too_few)?;
            mean_square +=
                (x.iter().zip(&targets)).map(|(x, y)| (process.mean(x) - y).powi(2)).sum::<f64>() / n;
            values.extend(process.logarithms());
        }
        for (x, y) in x.iter().zip(&y) {
            values.extend(x);
            values.extend(y);
        }
        values.resize(self.parameters().iter().map(|p| p.1).sum(), 0.0);
        Ok((values, mean_square))
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let settings = trained.settings;
        let processes = self.processes.get_or_init(|| Processes::restore(&trained.values()));
        let (Some(processes), Some(push)) = (processes, settings.engine.push_model()) else {
            return Err(crate::Difference::Unfinished.into());
        };
        let mut rng = random_stream(settings.seed, "gp-residual", 1 + task.index);
        let start = [task.start[0], task.start[1], task.start[2]];
        // With sampling, lane 0 is the mean path, on which the variance is evaluated; its poses are not
        // returned.
        let lanes = if self.is_sampled { samples + 1 } else { 1 };
        let mut now = vec![start; lanes];
        let mut values = vec![0.0_f32; task.time * 3 * samples];
        (0..3).for_each(|j| values[j * samples..][..samples].fill(start[j] as f32));
        for stride in split_into_strides(task.actions) {
            let mut sd = [0.0; OUTPUTS];
            for (lane, now) in now.iter_mut().enumerate() {
                let pose = *now;
                let displacement = match contact_stride(push, &pose, &stride) {
                    None => [0.0; 3],
                    Some(contact) => {
                        let x = processes.standardise(&contact.input);
                        if lane == 0 && self.is_sampled {
                            let variance = |j: usize| processes.per_output[j].variance(&x);
                            sd = std::array::from_fn(|j| variance(j).max(0.0).sqrt());
                        }
                        let residual: [f64; OUTPUTS] = std::array::from_fn(|j| {
                            let noise: f64 = if lane == 0 { 0.0 } else { StandardNormal.sample(&mut rng) };
                            processes.outputs[j]
                                * (processes.per_output[j].mean(&x) + sd[j] * noise)
                                * contact.travel_m
                        });
                        let [x, y] = to_object_frame(contact.normal, [residual[0], residual[1]]);
                        let [px, py, angle] = contact.physical;
                        [px + x, py + y, angle + residual[2] / push.c_m()]
                    }
                };
                let next = StartFrame::new(&pose, 0.0).pose_back(displacement);
                if lane + 1 > lanes - samples {
                    let sample = lane + samples - lanes;
                    let free_fraction = travel_before_contact(push, &pose, &stride);
                    for (t, fraction) in stride.motion_fractions(free_fraction) {
                        for j in 0..3 {
                            let v = pose[j] + fraction * (next[j] - pose[j]);
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
