//! Motion cut into strides: from one state to the next of a ball, or of a push between places along the rod's path.
//!
//! A stride of a push is [`STRIDE_M`] of the rod's travel, because poses are too noisy for every sample to start a step from (0.3 mm
//! each, as far as a slow rod moves in one). Between the ends of a stride poses are interpolated by the rod's travel. What is read is in
//! the object's own frame at the beginning of the stride, so that a forecast does not depend on where on the table the push happens.

use super::trained::Trained;
use crate::engine::{Engine, ModelPush, WrittenMotion};
use crate::prepared::Prepared;
use crate::push::StartFrame;
use crate::rates::features as rates;
use crate::rates::roll::{Motions, roll as roll_out, starts_of};
use crate::scales::{Scales, positive};
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use crate::{Samples, Task, steps};
use augsim_data::random_stream;
use augsim_physics::push::GRAVITY_M_S2;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Travel of the rod in a stride of a push, m.
const STRIDE_M: f64 = 8e-3;
/// Standard units beyond which a feature is cut: what lies further was never trained on.
const CUT: f64 = 6.0;
/// Least scale that is not rounding.
const LEAST: f64 = 1e-9;
/// Features of a stride of a push without physics, and what physics adds.
const PUSH_FEATURES: [usize; 2] = [9, 6];

/// Draws of the correction of one stride, for many samples at once.
pub(crate) trait Steps {
    /// The corrections `[S, lane]` for features `u [U, lane]`, in their own units, with noise drawn from `rng`.
    fn draw(&mut self, u: &[f32], rng: &mut Xoshiro256PlusPlus, out: &mut [f32]);

    /// Whether the rows of [`raw`] follow the features.
    fn reads_contacts(&self) -> bool {
        false
    }
}

/// Width of what [`raw`] gives.
pub(crate) const RAW: usize = 7;

/// The rod's place and way in the object's frame, m, and the units of the corrections.
fn raw(scales: &Scales, pose: &[f64; 3], stride: &Stride<'_>) -> [f32; RAW] {
    let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
    let frame = StartFrame::new(pose, 0.0);
    let ([x, y], [dx, dy]) = (frame.point([a[0], a[1]]), frame.vector([b[0] - a[0], b[1] - a[1]]));
    let unit = &scales.correction;
    [x, y, dx, dy, unit[0], unit[1], unit[2]].map(|v| v as f32)
}

/// Targets and conditions of a push outright, with [`raw`] behind the features.
pub(crate) fn prepare_contacts(settings: &Settings, scales: &Scales, q: &Sequence) -> Prepared {
    let plain = prepare(settings, false, scales, q);
    let mut u = Vec::with_capacity(plain.time * (plain.u_width + RAW));
    for (row, stride) in plain.u.chunks_exact(plain.u_width).zip(strides_of(&q.actions)) {
        let pose = [0, 1, 2].map(|j| q.state(stride.first)[j]);
        u.extend_from_slice(row);
        u.extend(raw(scales, &pose, &stride));
    }
    Prepared { u_width: plain.u_width + RAW, u, ..plain }
}

/// Width of the features.
pub(crate) fn width(settings: &Settings, physics: bool) -> usize {
    if let Some(motion) = settings.engine.rates() {
        return rates::width(motion);
    }
    match settings.engine.pushing() {
        Some(_) => PUSH_FEATURES[0] + if physics { PUSH_FEATURES[1] } else { 0 },
        None => (if physics { 5 } else { 2 }) * settings.engine.columns().len(),
    }
}

/// Sizes of the scales: means, deviations, steps, corrections.
pub(crate) fn scale_sizes(settings: &Settings, physics: bool, state: usize) -> [usize; 4] {
    if let Some(motion) = settings.engine.rates() {
        return rates::scale_sizes(motion);
    }
    match settings.engine.pushing() {
        Some(_) => [width(settings, physics), width(settings, physics), 0, state],
        None => [state; 4],
    }
}

/// The step that is corrected: the physics', or none at all.
fn advance(engine: &Engine, physics: bool, now: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
    match physics {
        true => engine.step(now, from, to, next),
        false => next.copy_from_slice(now),
    }
}

/// Features of a step of a ball from `now` to `next`; without physics those of `now` alone.
fn ball_features(scales: &Scales, physics: bool, now: &[f64], next: &[f64], out: &mut [f32]) {
    if physics {
        return scales.write_features(now, next, out);
    }
    for j in 0..now.len() {
        out[2 * j..2 * j + 2].copy_from_slice(&scales.state_features(j, now[j]));
    }
}

/// Fits the scales on a training set.
pub(crate) fn fit(settings: &Settings, physics: bool, train: &Sequences) -> Scales {
    let engine = &settings.engine;
    if let Some(motion) = engine.rates() {
        return rates::fit(motion, train);
    }
    let Some(push) = engine.pushing() else {
        return steps::fit_with(&|now, from, to, next| advance(engine, physics, now, from, to, next), train);
    };
    let width = width(settings, physics);
    let (mut n, mut sum, mut sum2, mut square) = (0.0, vec![0.0; width], vec![0.0; width], [0.0; 3]);
    for q in &train.items {
        each_stride(push, physics, q, |u, target| {
            n += 1.0;
            u.iter().zip(sum.iter_mut().zip(&mut sum2)).for_each(|(v, (s, s2))| {
                *s += v;
                *s2 += v * v;
            });
            square.iter_mut().zip(target).for_each(|(s, v)| *s += v * v);
        });
    }
    let mean: Vec<f64> = sum.iter().map(|v| v / n).collect();
    let sd = sum2.iter().zip(&mean).map(|(v, m)| positive((v / n - m * m).max(0.0).sqrt(), LEAST)).collect();
    let correction = square.iter().map(|v| positive((v / n).sqrt(), LEAST)).collect();
    Scales { mean, sd, step: Vec::new(), correction }
}

/// Targets and conditions of a whole trajectory, a row a stride.
pub(crate) fn prepare(settings: &Settings, physics: bool, scales: &Scales, q: &Sequence) -> Prepared {
    if let Some(motion) = settings.engine.rates() {
        return rates::prepare(motion, scales, q);
    }
    let u_width = width(settings, physics);
    let (mut x, mut u) = (Vec::new(), Vec::new());
    let engine = &settings.engine;
    match engine.pushing() {
        Some(push) => each_stride(push, physics, q, |features, target| {
            u.extend(standard(scales, features));
            x.extend(target.iter().zip(&scales.correction).map(|(v, unit)| (v / unit) as f32));
        }),
        None => {
            let s = q.states.len() / q.time;
            let (mut next, mut row) = (vec![0.0; s], vec![0.0; u_width]);
            for t in 0..q.time - 1 {
                let (now, after) = (q.state(t), q.state(t + 1));
                advance(engine, physics, now, q.action(t), q.action(t + 1), &mut next);
                ball_features(scales, physics, now, &next, &mut row);
                u.extend_from_slice(&row);
                x.extend((0..s).map(|j| ((after[j] - next[j]) / scales.unit(j, now, &next)) as f32));
            }
        }
    }
    let x_width = q.states.len() / q.time;
    Prepared { time: u.len() / u_width, x_width, u_width, x, u }
}

fn standard<'a>(scales: &'a Scales, u: &'a [f64]) -> impl Iterator<Item = f32> + 'a {
    let each = u.iter().zip(scales.mean.iter().zip(&scales.sd));
    each.map(|(v, (mean, sd))| ((v - mean) / sd).clamp(-CUT, CUT) as f32)
}

/// Rolls strides out from the first state; `steps` draws each correction.
pub(crate) fn roll(
    trained: Trained<'_>,
    physics: bool,
    task: Task<'_>,
    samples: usize,
    steps: &mut dyn Steps,
) -> Samples {
    let mut rng = random_stream(trained.settings.seed, "league", task.index);
    if let Some(motion) = trained.settings.engine.rates() {
        return roll_rates(trained, motion, task, samples, steps, &mut rng);
    }
    match trained.settings.engine.pushing() {
        Some(push) => roll_push(trained, push, physics, task, samples, steps, &mut rng),
        None => roll_ball(trained, physics, task, samples, steps, &mut rng),
    }
}

fn roll_rates(
    Trained { scales, .. }: Trained<'_>,
    motion: &WrittenMotion,
    task: Task<'_>,
    samples: usize,
    steps: &mut dyn Steps,
    rng: &mut Xoshiro256PlusPlus,
) -> Samples {
    let starts = starts_of(task.start, motion.periods().len(), samples);
    let motions = Motions { starts: &starts, actions: task.actions, time: task.time };
    let (d, unit) = (motion.corrected(), rates::Units::of(scales).target);
    let mut correction = vec![0.0; d * samples];
    roll_out(motion, scales, motions, &mut |u, out| {
        steps.draw(u, rng, &mut correction);
        for (i, (out, v)) in out.iter_mut().zip(&correction).enumerate() {
            *out = unit[i / samples] * f64::from(*v);
        }
    })
}

fn roll_ball(
    Trained { settings, scales, .. }: Trained<'_>,
    physics: bool,
    task: Task<'_>,
    samples: usize,
    steps: &mut dyn Steps,
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
            advance(&settings.engine, physics, from, action(t), action(t + 1), to);
            ball_features(scales, physics, from, to, &mut row);
            u[lane..].iter_mut().step_by(samples).zip(&row).for_each(|(slot, v)| *slot = *v);
        }
        steps.draw(&u, rng, &mut correction);
        for lane in 0..samples {
            for j in 0..s {
                let at = lane * s + j;
                let unit = scales.unit_of(j, next[at] - now[at]);
                next[at] += unit * f64::from(correction[j * samples + lane]);
            }
        }
        now.copy_from_slice(&next);
    }
    Samples { count: samples, values }
}

fn roll_push(
    Trained { settings, scales, .. }: Trained<'_>,
    push: &ModelPush,
    physics: bool,
    task: Task<'_>,
    samples: usize,
    steps: &mut dyn Steps,
    rng: &mut Xoshiro256PlusPlus,
) -> Samples {
    let contacts = steps.reads_contacts();
    let width = width(settings, physics) + if contacts { RAW } else { 0 };
    let mut values = vec![0.0_f32; task.time * 3 * samples];
    let start = [task.start[0], task.start[1], task.start[2]];
    let (mut now, mut before) = (vec![start; samples], vec![[0.0; 3]; samples]);
    let mut physical = vec![[0.0; 3]; samples];
    let (mut u, mut correction) = (vec![0.0; width * samples], vec![0.0; 3 * samples]);
    (0..3).for_each(|j| values[j * samples..][..samples].fill(start[j] as f32));
    for stride in strides_of(task.actions) {
        for lane in 0..samples {
            let (features, moved) = look(push, physics, &now[lane], &before[lane], &stride);
            physical[lane] = moved;
            let behind = contacts.then(|| raw(scales, &now[lane], &stride));
            let row = standard(scales, &features).chain(behind.into_iter().flatten());
            u[lane..].iter_mut().step_by(samples).zip(row).for_each(|(slot, v)| *slot = v);
        }
        steps.draw(&u, rng, &mut correction);
        for lane in 0..samples {
            let moved = [0, 1, 2].map(|j| {
                physical[lane][j] + scales.correction[j] * f64::from(correction[j * samples + lane])
            });
            let next = StartFrame::new(&now[lane], 0.0).pose_back(moved);
            for (t, share) in stride.shares(touching_share(push, &now[lane], &stride)) {
                for j in 0..3 {
                    let v = now[lane][j] + share * (next[j] - now[lane][j]);
                    values[(t * 3 + j) * samples + lane] = v as f32;
                }
            }
            (now[lane], before[lane]) = (next, moved);
        }
    }
    Samples { count: samples, values }
}

/// A stride of a push: the samples from `first` to `last`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stride<'a> {
    actions: &'a [f64],
    pub first: usize,
    pub last: usize,
}

impl Stride<'_> {
    /// The rod at sample `t`: position, m, and time, s.
    pub fn rod(&self, t: usize) -> [f64; 3] {
        [self.actions[3 * t], self.actions[3 * t + 1], self.actions[3 * t + 2]]
    }

    /// The samples after the first with their share of the object's motion: that of the rod's travel after the share `free` at which it
    /// touches; of time, where the rod rests.
    pub fn shares(&self, free: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
        let travel = |t: usize| {
            let (a, b) = (self.rod(t - 1), self.rod(t));
            (b[0] - a[0]).hypot(b[1] - a[1])
        };
        let whole: f64 = (self.first + 1..=self.last).map(travel).sum();
        let lapse = self.rod(self.last)[2] - self.rod(self.first)[2];
        let mut done = 0.0;
        (self.first + 1..=self.last).map(move |t| {
            done += travel(t);
            let share = match whole > 1e-9 {
                true => done / whole,
                false => (self.rod(t)[2] - self.rod(self.first)[2]) / lapse.max(1e-9),
            };
            (t, ((share - free) / (1.0 - free)).max(0.0))
        })
    }
}

/// Share of a stride's travel after which the rod touches the object at rest; 0 where it touches at once, or not at all.
pub(crate) fn touching_share(push: &ModelPush, pose: &[f64; 3], stride: &Stride<'_>) -> f64 {
    let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
    let frame = StartFrame::new(pose, 0.0);
    let nearest = push.world().object().outline.nearest(frame.point([a[0], a[1]]));
    let travel = frame.vector([b[0] - a[0], b[1] - a[1]]);
    let approach = -(travel[0] * nearest.outward[0] + travel[1] * nearest.outward[1]);
    let gap = nearest.distance - push.rod_radius_m();
    if gap > 0.0 && gap < 0.99 * approach { gap / approach } else { 0.0 }
}

/// The strides along rod positions `[time, (x, y, t)]`: each ends where the rod has travelled [`STRIDE_M`], or with the push.
pub(crate) fn strides_of(actions: &[f64]) -> Vec<Stride<'_>> {
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

/// Visits the strides of a measured push: features, and the target in the units of the data, both in the object's frame.
fn each_stride(push: &ModelPush, physics: bool, q: &Sequence, mut visit: impl FnMut(&[f64], [f64; 3])) {
    let mut before = [0.0; 3];
    let pose = |t: usize| [q.state(t)[0], q.state(t)[1], q.state(t)[2]];
    for stride in strides_of(&q.actions) {
        let now = pose(stride.first);
        let (u, physical) = look(push, physics, &now, &before, &stride);
        let moved = StartFrame::new(&now, 0.0).pose(&pose(stride.last));
        visit(&u, [0, 1, 2].map(|j| moved[j] - physical[j]));
        before = moved;
    }
}

/// A measured stride in the object's frame at its beginning: place and way of the rod, m, and displacement of the object, m, m, rad.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RodWay {
    pub rod: [f64; 2],
    pub travel: [f64; 2],
    pub moved: [f64; 3],
}

/// The strides of a measured push.
pub(crate) fn contacts(q: &Sequence) -> Vec<RodWay> {
    let of = |stride: Stride<'_>| {
        let frame = StartFrame::new(q.state(stride.first), 0.0);
        let (a, b) = (stride.rod(stride.first), stride.rod(stride.last));
        RodWay {
            rod: frame.point([a[0], a[1]]),
            travel: frame.vector([b[0] - a[0], b[1] - a[1]]),
            moved: frame.pose(q.state(stride.last)),
        }
    };
    strides_of(&q.actions).into_iter().map(of).collect()
}

/// Features of a stride from a pose, and the displacement that the physics expects; 0 without physics. `before` is the displacement
/// of the stride before: whether the object coasts does not show in a pose. Lengths are divided by c.
fn look(
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
    let lapse = (b[2] - a[2]).max(1e-6);
    let speed = travel[0].hypot(travel[1]) / lapse;
    let unit_speed = (c * push.support_friction() * GRAVITY_M_S2).sqrt();
    let mut u = vec![
        rod[0] / c,
        rod[1] / c,
        travel[0] / c,
        travel[1] / c,
        (speed / unit_speed).asinh(),
        (lapse * unit_speed / c).sqrt(),
        before[0] / c,
        before[1] / c,
        before[2],
    ];
    if !physics {
        return (u, [0.0; 3]);
    }
    let path = push.follow(pose, &[a, b].concat());
    let Some(((end, _), (_, instant))) = path.last().zip(path.first()) else { return (u, [0.0; 3]) };
    let moved = frame.pose(&[end.position[0], end.position[1], end.angle]);
    let inward = instant.outward.map(|n| -n);
    let gap = (instant.gap / (0.03 * c)).clamp(-3.0, 3.0).tanh();
    u.extend([moved[0] / c, moved[1] / c, moved[2], inward[0], inward[1], gap]);
    (u, moved)
}
