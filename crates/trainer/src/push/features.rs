//! Features of a push for the nets, and the units of their targets.
//!
//! - Neural: the rod in the frame of the initial pose and the time since the last sample; predicts the
//!   object's displacement. Neural+ has the same inputs and targets, with the net of Hybrid+.
//! - Hybrid: the features of Neural plus the displacement predicted by the physics; predicts the
//!   displacement.
//! - Hybrid+: dimensionless features of the physics' roll-out, in the frame of the first contact's normal;
//!   predicts the deviation from the roll-out in units of c. Lengths are divided by c and times by sqrt(c /
//!   (mu g)), so that by dimensional analysis another support, or another object of the same shape, is the
//!   same problem.

use super::frame::StartFrame;
use crate::engine::ModelPush;
use crate::prepared::Prepared;
use crate::recipe::Recipe;
use crate::scales::{Scales, positive};
use crate::sequences::{Sequence, Sequences};
use augsim_physics::push::planar::Rotation;
use augsim_physics::push::{GRAVITY_M_S2, Instant, Mode, Pose};
use rayon::prelude::*;

/// Bound of the standardised features: the net was not trained on values beyond it.
const FEATURE_BOUND: f64 = 6.0;
/// Expected deviation from the roll-out before anything has moved, in units of c: the measurement noise.
const NOISE_DEVIATION: f64 = 0.03;
/// Minimum normalisation scale; smaller scales are rounding errors.
const MIN_SCALE: f64 = 1e-9;
/// Expected deviation from the roll-out per distance moved, both in units of c.
const DEVIATION_PER_DISTANCE: f64 = 0.05;

/// Features of one push, and the transformation of its targets.
#[derive(Debug, Clone)]
pub(crate) struct Condition {
    /// Number of rows (samples) of the features.
    pub time: usize,
    /// Number of features per row of `u`.
    pub width: usize,
    /// Features `[time, width]`, not yet standardised.
    pub u: Vec<f64>,
    frame: StartFrame,
    /// Reference pose at each sample, which is subtracted from the measured pose to give the target; in `frame`.
    base: Vec<[f64; 3]>,
    /// Unit of length of the targets, in m.
    length_m: f64,
    /// Expected size of the deviation from the reference pose at each sample, by which targets are divided.
    size: Vec<f64>,
}

/// Number of features per row, by recipe.
pub(crate) fn width(recipe: Recipe) -> usize {
    match recipe {
        Recipe::Neural | Recipe::NeuralPlus => 3,
        Recipe::Hybrid | Recipe::HybridStandardised => 6,
        // Baselines of the league define their own features.
        _ => 20,
    }
}

impl Condition {
    /// Computes the features of a push from the first pose and the rod's path alone.
    pub fn new(recipe: Recipe, engine: &ModelPush, start: &[f64], actions: &[f64]) -> Self {
        let time = actions.len() / 3;
        let action = |t: usize| &actions[3 * t..3 * t + 3];
        let interval = |t: usize| if t == 0 { 0.0 } else { action(t)[2] - action(t - 1)[2] };
        let frame = StartFrame::new(start, 0.0);
        let physics = || engine.follow(start, actions);
        let mut u = Vec::with_capacity(time * width(recipe));
        let (frame, base, length_m, size) = match recipe {
            Recipe::HybridPlus => {
                let path = physics();
                let turn = first_normal_angle(&path, start[2]);
                let frame = StartFrame::new(start, turn);
                let pose = |p: &Pose<f64>| frame.pose(&[p.position[0], p.position[1], p.angle]);
                let base: Vec<[f64; 3]> = path.iter().map(|(p, _)| pose(p)).collect();
                features(engine, &frame, turn, &path, &base, actions, &mut u);
                let size = expected_deviations(engine, &base, actions);
                (frame, base, engine.c_m(), size)
            }
            _ => {
                let is_without_physics = matches!(recipe, Recipe::Neural | Recipe::NeuralPlus);
                let path = if is_without_physics { Vec::new() } else { physics() };
                for t in 0..time {
                    u.extend(frame.point([action(t)[0], action(t)[1]]));
                    u.push(interval(t));
                    if let Some((p, _)) = path.get(t) {
                        u.extend(frame.pose(&[p.position[0], p.position[1], p.angle]));
                    }
                }
                (frame, vec![[0.0; 3]; time], 1.0, vec![1.0; time])
            }
        };
        Condition { time, width: width(recipe), u, frame, base, length_m, size }
    }

    /// Computes the net's targets `[time, 3]` from measured states.
    pub fn targets(&self, states: &[f64]) -> Vec<f64> {
        let rows = states.chunks_exact(3).zip(self.base.iter().zip(&self.size));
        rows.flat_map(|(s, (b, size))| {
            let p = self.frame.pose(s);
            let unit = self.length_m * size;
            [(p[0] - b[0]) / unit, (p[1] - b[1]) / unit, (p[2] - b[2]) / size]
        })
        .collect()
    }

    /// Converts a target at sample `t` back to a pose in the frame of the data.
    pub fn restore(&self, t: usize, target: [f64; 3]) -> [f64; 3] {
        let (b, size) = (self.base[t], self.size[t]);
        let unit = self.length_m * size;
        self.frame.pose_back([b[0] + unit * target[0], b[1] + unit * target[1], b[2] + size * target[2]])
    }
}

/// Fits the normalisation scales on a training set.
pub(crate) fn fit(recipe: Recipe, engine: &ModelPush, train: &Sequences) -> Scales {
    let rows: Vec<(Condition, Vec<f64>)> = (train.items.par_iter())
        .map(|q| {
            let c = Condition::new(recipe, engine, q.state(0), &q.actions);
            let x = c.targets(&q.states);
            (c, x)
        })
        .collect();
    let width = width(recipe);
    let n: f64 = rows.iter().map(|(c, _)| c.time as f64).sum();
    let mean_of = |f: &dyn Fn(f64) -> f64, j: usize| {
        rows.iter().flat_map(|(c, _)| c.u.iter().skip(j).step_by(width)).map(|v| f(*v)).sum::<f64>() / n
    };
    let mean: Vec<f64> = (0..width).map(|j| mean_of(&|v| v, j)).collect();
    let sd = (0..width).map(|j| positive(mean_of(&|v| (v - mean[j]).powi(2), j).sqrt(), MIN_SCALE)).collect();
    let square =
        |j: usize| rows.iter().flat_map(|(_, x)| x.iter().skip(j).step_by(3)).map(|v| v * v).sum::<f64>() / n;
    let correction = (0..3).map(|j| positive(square(j).sqrt(), MIN_SCALE)).collect();
    Scales { mean, sd, step: Vec::new(), correction }
}

/// Computes standardised features, `[time, width]`.
pub(crate) fn standard(scales: &Scales, condition: &Condition) -> Vec<f32> {
    let scaled = |(i, v): (usize, &f64)| {
        let j = i % condition.width;
        ((v - scales.mean[j]) / scales.sd[j]).clamp(-FEATURE_BOUND, FEATURE_BOUND) as f32
    };
    condition.u.iter().enumerate().map(scaled).collect()
}

/// Computes the targets and features of a whole push.
pub(crate) fn prepare(recipe: Recipe, engine: &ModelPush, scales: &Scales, q: &Sequence) -> Prepared {
    let condition = Condition::new(recipe, engine, q.state(0), &q.actions);
    let targets = condition.targets(&q.states);
    let x = targets.iter().enumerate().map(|(i, v)| (v / scales.correction[i % 3]) as f32).collect();
    let u = standard(scales, &condition);
    Prepared { time: q.time, x_width: 3, u_width: condition.width, x, u }
}

/// Converts net outputs `[time, 3, lanes]` to poses in the frame of the data, in place.
pub(crate) fn restore(scales: &Scales, condition: &Condition, values: &mut [f32], lanes: usize) {
    for (t, row) in values.chunks_exact_mut(3 * lanes).enumerate() {
        for lane in 0..lanes {
            let target = [0, 1, 2].map(|j| scales.correction[j] * f64::from(row[j * lanes + lane]));
            let pose = condition.restore(t, target);
            (0..3).for_each(|j| row[j * lanes + lane] = pose[j] as f32);
        }
    }
}

/// Angle of the first contact's inward normal in the frame of the initial pose.
/// If the rod never touches, the normal at the point nearest to the first rod position is used.
fn first_normal_angle(path: &[(Pose<f64>, Instant<f64>)], start_angle: f64) -> f64 {
    let touches = |m: Mode| matches!(m, Mode::Stick | Mode::Left | Mode::Right);
    let contact = path.iter().find(|(_, i)| touches(i.mode)).or(path.first());
    contact.map_or(0.0, |(pose, instant)| {
        let inward = Rotation::new(pose.angle - start_angle).to_world(instant.outward.map(|n| -n));
        inward[1].atan2(inward[0])
    })
}

/// Expected size of the deviation from the roll-out at each sample, in units of c.
/// It grows with the distance that the object has moved and with the distance that it would coast from the
/// fastest speed of the rod so far. A slow push deviates by tenths of a millimetre, a fast one by
/// centimetres; in these units both are of order one.
fn expected_deviations(engine: &ModelPush, base: &[[f64; 3]], actions: &[f64]) -> Vec<f64> {
    let deceleration = engine.support_friction() * GRAVITY_M_S2;
    let (mut distance, mut coast) = (0.0, 0.0_f64);
    let mut deviations = Vec::with_capacity(base.len());
    for (t, pose) in base.iter().enumerate() {
        if t > 0 {
            let before = base[t - 1];
            let step = (pose[0] - before[0]).hypot(pose[1] - before[1]) / engine.c_m();
            let rotation = (pose[2] - before[2]).abs();
            distance += step + rotation;
            if step + rotation > 0.0 {
                let (a, b) = (&actions[3 * (t - 1)..3 * t], &actions[3 * t..3 * t + 3]);
                let speed = (b[0] - a[0]).hypot(b[1] - a[1]) / (b[2] - a[2]).max(1e-6);
                coast = coast.max(speed * speed / (2.0 * deceleration * engine.c_m()));
            }
        }
        deviations.push(NOISE_DEVIATION + DEVIATION_PER_DISTANCE * distance + coast);
    }
    deviations
}

/// Appends the dimensionless features of the roll-out to `u`, [`width`] per row.
fn features(
    engine: &ModelPush,
    frame: &StartFrame,
    turn: f64,
    path: &[(Pose<f64>, Instant<f64>)],
    base: &[[f64; 3]],
    actions: &[f64],
    u: &mut Vec<f64>,
) {
    let c = engine.c_m();
    let deceleration = engine.support_friction() * GRAVITY_M_S2;
    let time_unit = (c / deceleration).sqrt();
    for (t, (_, instant)) in path.iter().enumerate() {
        let row = &actions[3 * t..3 * t + 3];
        let before = if t == 0 { row } else { &actions[3 * (t - 1)..3 * t] };
        let previous = if t == 0 { base[0] } else { base[t - 1] };
        let interval = (row[2] - before[2]).max(0.0);
        // Rotation from the object's axes to the frame of the first normal.
        let body = Rotation::new(base[t][2] - turn);
        let to_body_axes = |v: [f64; 2]| Rotation::new(base[t][2]).to_body(v);
        let rod = frame.point([row[0], row[1]]);
        let travel = frame.vector([row[0] - before[0], row[1] - before[1]]);
        let arm = to_body_axes([rod[0] - base[t][0], rod[1] - base[t][1]]);
        let rod_step = to_body_axes(travel);
        let moved = to_body_axes([base[t][0] - previous[0], base[t][1] - previous[1]]);
        let rotation = base[t][2] - previous[2];
        let inward = body.to_world(instant.outward.map(|n| -n));
        let inward = to_body_axes(inward);
        let rate = if interval > 0.0 { 1.0 / interval } else { 0.0 };
        // Coasting distance of an object with this displacement per sample, in units of c.
        let coast = |v: [f64; 2]| {
            let speed = v[0].hypot(v[1]) * rate;
            v.map(|x| x * rate * speed / (2.0 * deceleration * c))
        };
        let spin = rotation * rate * c;
        u.extend([
            base[t][0] / c,
            base[t][1] / c,
            base[t][2],
            arm[0] / c,
            arm[1] / c,
            rod_step[0] / c,
            rod_step[1] / c,
            moved[0] / c,
            moved[1] / c,
            rotation,
            inward[0],
            inward[1],
            (instant.gap / (0.03 * c)).clamp(-3.0, 3.0).tanh(),
            (interval / time_unit).sqrt(),
        ]);
        u.extend(coast(moved));
        u.push(spin * spin.abs() / (2.0 * deceleration * c));
        u.extend(coast(rod_step));
        u.push((travel[0].hypot(travel[1]) * rate / (deceleration * c).sqrt()).asinh());
    }
}
