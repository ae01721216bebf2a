//! Features, targets and roll-outs of classes that predict single steps, or strides of a push.
//!
//! A stride is a segment of a push in which the rod travels [`STRIDE_M`]. Single samples would be too short:
//! the noise of a pose (0.3 mm) is as large as the motion of a slow rod per sample. Between the ends of a
//! stride, poses are interpolated by the rod's travel. Features and targets are in the object's frame at the
//! start of the stride, so that a forecast does not depend on the position on the table.

use super::trained::Trained;
use crate::engine::{Engine, EquationMotion, ModelPush};
use crate::prepared::Prepared;
use crate::push::StartFrame;
use crate::rates::features as rates;
use crate::rates::roll_out::{RollOuts, repeat_starts, roll_out as roll_out_motion};
use crate::scales::{Scales, positive};
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use crate::{Samples, Task, steps};
use augsim_data::random_stream;
use augsim_physics::push::GRAVITY_M_S2;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Distance that the rod moves in a stride (segment of a push), m.
const STRIDE_M: f64 = 8e-3;
/// Limit to which features are clipped, in standard units; larger values are outside the training range.
const FEATURE_LIMIT: f64 = 6.0;
/// Smallest normalisation scale that is not a rounding error.
const MIN_SCALE: f64 = 1e-9;
/// Number of features of a stride (segment of a push) without physics.
const PUSH_FEATURES: usize = 9;
/// Number of additional features of a stride (segment of a push) with physics.
const PHYSICS_FEATURES: usize = 6;

/// A model that samples the correction of one step, for many trajectories at once.
pub(crate) trait CorrectionSampler {
    /// Writes sampled corrections `[S, lane]`, in units of the targets, for features `u [U, lane]`.
    fn sample(&mut self, u: &[f32], rng: &mut Xoshiro256PlusPlus, out: &mut [f32]);

    /// Whether the sampler needs the values of [`rod_motion_row`] after the features.
    fn needs_rod_motion(&self) -> bool {
        false
    }
}

/// Number of values of [`rod_motion_row`]: position, travel and units.
pub(crate) const ROD_MOTION_WIDTH: usize = 7;

/// Returns the rod's position and travel in the object's frame, m, and the units of the corrections.
fn rod_motion_row(scales: &Scales, pose: &[f64; 3], stride: &Stride<'_>) -> [f32; ROD_MOTION_WIDTH] {
    let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
    let frame = StartFrame::new(pose, 0.0);
    let ([x, y], [dx, dy]) = (frame.point([a[0], a[1]]), frame.vector([b[0] - a[0], b[1] - a[1]]));
    let unit = &scales.correction;
    [x, y, dx, dy, unit[0], unit[1], unit[2]].map(|v| v as f32)
}

/// Computes targets and conditions (net inputs) of a push without physics; rows end with [`rod_motion_row`].
pub(crate) fn prepare_push_strides(settings: &Settings, scales: &Scales, q: &Sequence) -> Prepared {
    let rows = prepare(settings, false, scales, q);
    let mut u = Vec::with_capacity(rows.time * (rows.u_width + ROD_MOTION_WIDTH));
    for (row, stride) in rows.u.chunks_exact(rows.u_width).zip(split_into_strides(&q.actions)) {
        let pose = [0, 1, 2].map(|j| q.state(stride.first)[j]);
        u.extend_from_slice(row);
        u.extend(rod_motion_row(scales, &pose, &stride));
    }
    Prepared { u_width: rows.u_width + ROD_MOTION_WIDTH, u, ..rows }
}

/// Returns the number of features (net inputs) per step.
pub(crate) fn width(settings: &Settings, physics: bool) -> usize {
    if let Some(motion) = settings.engine.rate_model() {
        return rates::width(motion);
    }
    match settings.engine.push_model() {
        Some(_) => PUSH_FEATURES + if physics { PHYSICS_FEATURES } else { 0 },
        None => (if physics { 5 } else { 2 }) * settings.engine.columns().len(),
    }
}

/// Number of values of each normalisation scale: mean, sd, step, correction.
pub(crate) fn scale_sizes(settings: &Settings, physics: bool, state: usize) -> [usize; 4] {
    if let Some(motion) = settings.engine.rate_model() {
        return rates::scale_sizes(motion);
    }
    match settings.engine.push_model() {
        Some(_) => [width(settings, physics), width(settings, physics), 0, state],
        None => [state; 4],
    }
}

/// Computes the step that the net corrects: the physics step, or without physics no motion.
fn uncorrected_step(engine: &Engine, physics: bool, now: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
    match physics {
        true => engine.step(now, from, to, next),
        false => next.copy_from_slice(now),
    }
}

/// Writes the features of a ball's step from `now` to `next`; without physics those of `now` alone.
fn write_ball_features(scales: &Scales, physics: bool, now: &[f64], next: &[f64], out: &mut [f32]) {
    if physics {
        return scales.write_features(now, next, out);
    }
    for j in 0..now.len() {
        out[2 * j..2 * j + 2].copy_from_slice(&scales.state_features(j, now[j]));
    }
}

/// Fits the normalisation scales on a training set.
pub(crate) fn fit(settings: &Settings, physics: bool, train: &Sequences) -> Scales {
    let engine = &settings.engine;
    if let Some(motion) = engine.rate_model() {
        return rates::fit(motion, train);
    }
    let Some(push) = engine.push_model() else {
        return steps::fit_with(
            &|now, from, to, next| uncorrected_step(engine, physics, now, from, to, next),
            train,
        );
    };
    let width = width(settings, physics);
    let (mut n, mut sum, mut sum2, mut square) = (0.0, vec![0.0; width], vec![0.0; width], [0.0; 3]);
    for q in &train.items {
        for_each_stride(push, physics, q, |u, target| {
            n += 1.0;
            u.iter().zip(sum.iter_mut().zip(&mut sum2)).for_each(|(v, (s, s2))| {
                *s += v;
                *s2 += v * v;
            });
            square.iter_mut().zip(target).for_each(|(s, v)| *s += v * v);
        });
    }
    let mean: Vec<f64> = sum.iter().map(|v| v / n).collect();
    let sd =
        sum2.iter().zip(&mean).map(|(v, m)| positive((v / n - m * m).max(0.0).sqrt(), MIN_SCALE)).collect();
    let correction = square.iter().map(|v| positive((v / n).sqrt(), MIN_SCALE)).collect();
    Scales { mean, sd, step: Vec::new(), correction }
}

/// Computes targets and conditions (net inputs) of a trajectory, one row per step or stride.
pub(crate) fn prepare(settings: &Settings, physics: bool, scales: &Scales, q: &Sequence) -> Prepared {
    if let Some(motion) = settings.engine.rate_model() {
        return rates::prepare(motion, scales, q);
    }
    let u_width = width(settings, physics);
    let (mut x, mut u) = (Vec::new(), Vec::new());
    let engine = &settings.engine;
    match engine.push_model() {
        Some(push) => for_each_stride(push, physics, q, |features, target| {
            u.extend(standardised(scales, features));
            x.extend(target.iter().zip(&scales.correction).map(|(v, unit)| (v / unit) as f32));
        }),
        None => {
            let s = q.states.len() / q.time;
            let (mut next, mut row) = (vec![0.0; s], vec![0.0; u_width]);
            for t in 0..q.time - 1 {
                let (now, after) = (q.state(t), q.state(t + 1));
                uncorrected_step(engine, physics, now, q.action(t), q.action(t + 1), &mut next);
                write_ball_features(scales, physics, now, &next, &mut row);
                u.extend_from_slice(&row);
                x.extend((0..s).map(|j| ((after[j] - next[j]) / scales.unit(j, now, &next)) as f32));
            }
        }
    }
    let x_width = q.states.len() / q.time;
    Prepared { time: u.len() / u_width, x_width, u_width, x, u }
}

/// Converts features to standard units, clipped to [`FEATURE_LIMIT`].
fn standardised<'a>(scales: &'a Scales, u: &'a [f64]) -> impl Iterator<Item = f32> + 'a {
    let pairs = u.iter().zip(scales.mean.iter().zip(&scales.sd));
    pairs.map(|(v, (mean, sd))| ((v - mean) / sd).clamp(-FEATURE_LIMIT, FEATURE_LIMIT) as f32)
}

/// Simulates corrected steps from the initial state; `sampler` samples the corrections.
pub(crate) fn roll_out(
    trained: Trained<'_>,
    physics: bool,
    task: Task<'_>,
    samples: usize,
    sampler: &mut dyn CorrectionSampler,
) -> Samples {
    let mut rng = random_stream(trained.settings.seed, "league", task.index);
    if let Some(motion) = trained.settings.engine.rate_model() {
        return roll_out_rates(trained, motion, task, samples, sampler, &mut rng);
    }
    match trained.settings.engine.push_model() {
        Some(push) => roll_out_push(trained, push, physics, task, samples, sampler, &mut rng),
        None => roll_out_ball(trained, physics, task, samples, sampler, &mut rng),
    }
}

/// Simulates a system of equations with corrected rates.
fn roll_out_rates(
    Trained { scales, .. }: Trained<'_>,
    motion: &EquationMotion,
    task: Task<'_>,
    samples: usize,
    sampler: &mut dyn CorrectionSampler,
    rng: &mut Xoshiro256PlusPlus,
) -> Samples {
    let starts = repeat_starts(task.start, motion.periods().len(), samples);
    let motions = RollOuts { starts: &starts, actions: task.actions, time: task.time };
    let (corrected, unit) = (motion.corrected_count(), rates::Units::from_scales(scales).target);
    let mut correction = vec![0.0; corrected * samples];
    roll_out_motion(motion, scales, motions, &mut |u, out| {
        sampler.sample(u, rng, &mut correction);
        for (i, (out, v)) in out.iter_mut().zip(&correction).enumerate() {
            *out = unit[i / samples] * f64::from(*v);
        }
    })
}

/// Simulates a ball with corrected steps of one sample interval.
fn roll_out_ball(
    Trained { settings, scales, .. }: Trained<'_>,
    physics: bool,
    task: Task<'_>,
    samples: usize,
    sampler: &mut dyn CorrectionSampler,
    rng: &mut Xoshiro256PlusPlus,
) -> Samples {
    let s = task.start.len();
    let a = task.actions.len() / task.time;
    let action = |t: usize| &task.actions[t * a..(t + 1) * a];
    let width = width(settings, physics);
    let mut values = vec![0.0_f32; task.time * s * samples];
    let mut now: Vec<f64> = task.start.repeat(samples);
    let mut next = now.clone();
    let (mut row, mut u) = (vec![0.0; width], vec![0.0; width * samples]);
    let mut correction = vec![0.0; s * samples];
    for t in 0..task.time {
        for (i, v) in now.iter().enumerate() {
            values[(t * s + i % s) * samples + i / s] = *v as f32;
        }
        if t + 1 == task.time {
            break;
        }
        for lane in 0..samples {
            let (from, to) = (&now[lane * s..][..s], &mut next[lane * s..][..s]);
            uncorrected_step(&settings.engine, physics, from, action(t), action(t + 1), to);
            write_ball_features(scales, physics, from, to, &mut row);
            u[lane..].iter_mut().step_by(samples).zip(&row).for_each(|(slot, v)| *slot = *v);
        }
        sampler.sample(&u, rng, &mut correction);
        for lane in 0..samples {
            for j in 0..s {
                let index = lane * s + j;
                let unit = scales.unit_of(j, next[index] - now[index]);
                next[index] += unit * f64::from(correction[j * samples + lane]);
            }
        }
        now.copy_from_slice(&next);
    }
    Samples { count: samples, values }
}

/// Simulates a push with corrected strides, and interpolates the poses within each stride.
fn roll_out_push(
    Trained { settings, scales, .. }: Trained<'_>,
    push: &ModelPush,
    physics: bool,
    task: Task<'_>,
    samples: usize,
    sampler: &mut dyn CorrectionSampler,
    rng: &mut Xoshiro256PlusPlus,
) -> Samples {
    let needs_rod_motion = sampler.needs_rod_motion();
    let width = width(settings, physics) + if needs_rod_motion { ROD_MOTION_WIDTH } else { 0 };
    let mut values = vec![0.0_f32; task.time * 3 * samples];
    let start = [task.start[0], task.start[1], task.start[2]];
    let (mut now, mut before) = (vec![start; samples], vec![[0.0; 3]; samples]);
    let mut physical = vec![[0.0; 3]; samples];
    let (mut u, mut correction) = (vec![0.0; width * samples], vec![0.0; 3 * samples]);
    (0..3).for_each(|j| values[j * samples..][..samples].fill(start[j] as f32));
    for stride in split_into_strides(task.actions) {
        for lane in 0..samples {
            let (features, displacement) = push_features(push, physics, &now[lane], &before[lane], &stride);
            physical[lane] = displacement;
            let rod_motion = needs_rod_motion.then(|| rod_motion_row(scales, &now[lane], &stride));
            let row = standardised(scales, &features).chain(rod_motion.into_iter().flatten());
            u[lane..].iter_mut().step_by(samples).zip(row).for_each(|(slot, v)| *slot = v);
        }
        sampler.sample(&u, rng, &mut correction);
        for lane in 0..samples {
            let displacement = [0, 1, 2].map(|j| {
                physical[lane][j] + scales.correction[j] * f64::from(correction[j * samples + lane])
            });
            let next = StartFrame::new(&now[lane], 0.0).pose_back(displacement);
            let free_fraction = travel_before_contact(push, &now[lane], &stride);
            for (t, fraction) in stride.motion_fractions(free_fraction) {
                for j in 0..3 {
                    let v = now[lane][j] + fraction * (next[j] - now[lane][j]);
                    values[(t * 3 + j) * samples + lane] = v as f32;
                }
            }
            (now[lane], before[lane]) = (next, displacement);
        }
    }
    Samples { count: samples, values }
}

/// A stride (segment) of a push: samples `first` to `last` of the rod's path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stride<'a> {
    actions: &'a [f64],
    pub first: usize,
    pub last: usize,
}

impl Stride<'_> {
    /// Position of the rod (m, m) and time (s) at sample `t`.
    pub fn rod(&self, t: usize) -> [f64; 3] {
        [self.actions[3 * t], self.actions[3 * t + 1], self.actions[3 * t + 2]]
    }

    /// Iterates over the stride's samples after the first, with the share of the object's motion done by then.
    ///
    /// The object moves in proportion to the rod's travel after contact, which happens at the fraction
    /// `free_fraction` of the travel. If the rod rests, the fraction of time replaces that of travel.
    pub fn motion_fractions(&self, free_fraction: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
        let travel = |t: usize| {
            let (a, b) = (self.rod(t - 1), self.rod(t));
            (b[0] - a[0]).hypot(b[1] - a[1])
        };
        let total: f64 = (self.first + 1..=self.last).map(travel).sum();
        let duration = self.rod(self.last)[2] - self.rod(self.first)[2];
        let mut done = 0.0;
        (self.first + 1..=self.last).map(move |t| {
            done += travel(t);
            let fraction = match total > 1e-9 {
                true => done / total,
                false => (self.rod(t)[2] - self.rod(self.first)[2]) / duration.max(1e-9),
            };
            (t, ((fraction - free_fraction) / (1.0 - free_fraction)).max(0.0))
        })
    }
}

/// Fraction of a stride's rod travel before the rod touches the resting object.
///
/// 0 if they are in contact from the start, or never.
pub(crate) fn travel_before_contact(push: &ModelPush, pose: &[f64; 3], stride: &Stride<'_>) -> f64 {
    let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
    let frame = StartFrame::new(pose, 0.0);
    let nearest = push.world().object().outline.nearest(frame.point([a[0], a[1]]));
    let travel = frame.vector([b[0] - a[0], b[1] - a[1]]);
    let approach = -(travel[0] * nearest.outward[0] + travel[1] * nearest.outward[1]);
    let gap = nearest.distance - push.rod_radius_m();
    if gap > 0.0 && gap < 0.99 * approach { gap / approach } else { 0.0 }
}

/// Splits rod positions `[time, (x, y, t)]` into strides (segments of a push).
///
/// A stride ends at the first sample at which the rod has travelled [`STRIDE_M`], or at the end of the push.
pub(crate) fn split_into_strides(actions: &[f64]) -> Vec<Stride<'_>> {
    let time = actions.len() / 3;
    let (mut out, mut first, mut travel) = (Vec::new(), 0, 0.0);
    for t in 1..time {
        let (a, b) = (&actions[3 * (t - 1)..3 * t], &actions[3 * t..3 * t + 3]);
        travel += (b[0] - a[0]).hypot(b[1] - a[1]);
        if travel >= STRIDE_M || t + 1 == time {
            out.push(Stride { actions, first, last: t });
            (first, travel) = (t, 0.0);
        }
    }
    out
}

/// Calls `visit` with features and target of each stride of a measured push.
///
/// The target is in units of the data; both are in the object's frame.
fn for_each_stride(push: &ModelPush, physics: bool, q: &Sequence, mut visit: impl FnMut(&[f64], [f64; 3])) {
    let mut before = [0.0; 3];
    let pose = |t: usize| [q.state(t)[0], q.state(t)[1], q.state(t)[2]];
    for stride in split_into_strides(&q.actions) {
        let now = pose(stride.first);
        let (u, physical) = push_features(push, physics, &now, &before, &stride);
        let displacement = StartFrame::new(&now, 0.0).pose(&pose(stride.last));
        visit(&u, [0, 1, 2].map(|j| displacement[j] - physical[j]));
        before = displacement;
    }
}

/// Motion of rod and object in a measured stride (segment of a push), in the object's frame at its start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RodMotion {
    /// Position of the rod at the start of the stride, m.
    pub rod: [f64; 2],
    /// Displacement of the rod during the stride, m.
    pub travel: [f64; 2],
    /// Displacement of the object during the stride (m, m, rad).
    pub displacement: [f64; 3],
}

/// Extracts the motions of rod and object in all strides of a measured push.
pub(crate) fn rod_motions(q: &Sequence) -> Vec<RodMotion> {
    let rod_motion = |stride: Stride<'_>| {
        let frame = StartFrame::new(q.state(stride.first), 0.0);
        let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
        RodMotion {
            rod: frame.point([a[0], a[1]]),
            travel: frame.vector([b[0] - a[0], b[1] - a[1]]),
            displacement: frame.pose(q.state(stride.last)),
        }
    };
    split_into_strides(&q.actions).into_iter().map(rod_motion).collect()
}

/// Computes the features of a stride, and the object's displacement that the physics predicts.
///
/// The displacement is 0 without physics.
///
/// `before` is the displacement in the previous stride, which shows whether the object coasts; a pose does
/// not. Lengths are divided by c.
fn push_features(
    push: &ModelPush,
    physics: bool,
    pose: &[f64; 3],
    before: &[f64; 3],
    stride: &Stride<'_>,
) -> (Vec<f64>, [f64; 3]) {
    let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
    let c = push.c_m();
    let frame = StartFrame::new(pose, 0.0);
    let rod = frame.point([a[0], a[1]]);
    let travel = frame.vector([b[0] - a[0], b[1] - a[1]]);
    let duration = (b[2] - a[2]).max(1e-6);
    let speed = travel[0].hypot(travel[1]) / duration;
    let unit_speed = (c * push.support_friction() * GRAVITY_M_S2).sqrt();
    let mut u = vec![
        rod[0] / c,
        rod[1] / c,
        travel[0] / c,
        travel[1] / c,
        (speed / unit_speed).asinh(),
        (duration * unit_speed / c).sqrt(),
        before[0] / c,
        before[1] / c,
        before[2],
    ];
    if !physics {
        return (u, [0.0; 3]);
    }
    let path = push.follow(pose, &[a, b].concat());
    let Some(((end, _), (_, instant))) = path.last().zip(path.first()) else { return (u, [0.0; 3]) };
    let displacement = frame.pose(&[end.position[0], end.position[1], end.angle]);
    let inward = instant.outward.map(|n| -n);
    let gap = (instant.gap / (0.03 * c)).clamp(-3.0, 3.0).tanh();
    u.extend([displacement[0] / c, displacement[1] / c, displacement[2], inward[0], inward[1], gap]);
    (u, displacement)
}
