//! SE3-Nets (Byravan, Fox 2017) in the plane, on points instead of images.
//!
//! Points on the object's outline, on the rod and on the table are assigned softly to [`BODIES`] bodies, and
//! each body moves rigidly. With affinities a_b and rigid motions (R_b, d_b), a point p has the flow
//! 1. flow(p) = sum over b of softmax(a)_b (R_b p + d_b - p).
//!
//! The net uses no physics and learns the assignment from the flows alone. It is trained on the flow of all
//! points over a stride; deterministic, as published. The forecast is the rigid motion closest (least
//! squares) to the predicted flow of the outline.

use super::strides::{self, CorrectionSampler, ROD_MOTION_WIDTH};
use super::{Class, Defaults, Extents, Kind, Learned, Trained, zero};
use crate::engine::ModelPush;
use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, mask_of, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{LinearRunner, MlpRunner};
use augsim_nn::{Bound, Linear, Mlp, Params};
use augsim_physics::{Dual, Scalar as Real};
use augsim_tensor::{Scalar, Tape, TensorError, Var};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Number of bodies that points can be assigned to.
const BODIES: usize = 3;
/// Number of values of a rigid motion in the plane: translation and rotation.
const MOTION: usize = 3;
/// Number of inputs from which a point's flow is computed: its affinity to each body, and all motions.
const INPUTS: usize = BODIES + BODIES * MOTION;
/// Number of points on the object's outline whose flow is predicted.
const OBJECT_POINTS: usize = 16;
/// Number of points on the rod's circumference whose flow is predicted.
const ROD_POINTS: usize = 4;
/// Number of points on the table whose flow is predicted.
const TABLE_POINTS: usize = 4;
const POINTS: usize = OBJECT_POINTS + ROD_POINTS + TABLE_POINTS;
/// Distance of the points on the table from the object's centre, in units of its largest radius.
const TABLE_DISTANCE: f64 = 2.5;
/// Number of first features of a row that hold the rod's position.
const ROD_POSITION: usize = 2;

pub(crate) static RIGID_FLOW: Class = Class {
    kind: Kind::RigidFlow,
    inputs: ClassInputs::PushStrides,
    defaults: Defaults { hidden: 32, sd_floor: 0.0, learning_rate: 3e-3 },
    is_pushing_only: true,
};

/// The points on object and table whose flow is predicted, in the object's frame, m.
#[derive(Debug, Clone)]
struct Scene {
    outline: Vec<[f64; 2]>,
    table: Vec<[f64; 2]>,
    rod_radius_m: f64,
    /// Unit c of the lengths that the net reads, m.
    c_m: f64,
}

/// What a point really belongs to: object, rod or table.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Owner {
    Object,
    Rod,
    Table,
}

impl Scene {
    fn new(push: &ModelPush) -> Self {
        let outline = &push.world().object().outline;
        let corners = outline.polygon(48);
        let corners = corners.vertices();
        let distance = TABLE_DISTANCE * outline.radius();
        let table = (0..TABLE_POINTS)
            .map(|k| TAU * (k as f64 + 0.5) / TABLE_POINTS as f64)
            .map(|a| [distance * a.cos(), distance * a.sin()]);
        Scene {
            outline: even_points(corners, OBJECT_POINTS),
            table: table.collect(),
            rod_radius_m: push.rod_radius_m(),
            c_m: push.c_m(),
        }
    }

    /// Iterates over all points with what they belong to, for the rod at position `rod`.
    fn points(&self, rod: [f64; 2]) -> impl Iterator<Item = (Owner, [f64; 2])> + '_ {
        let rim = (0..ROD_POINTS).map(move |k| {
            let angle = TAU * k as f64 / ROD_POINTS as f64;
            [rod[0] + self.rod_radius_m * angle.cos(), rod[1] + self.rod_radius_m * angle.sin()]
        });
        (self.outline.iter().map(|p| (Owner::Object, *p)))
            .chain(rim.map(|p| (Owner::Rod, p)))
            .chain(self.table.iter().map(|p| (Owner::Table, *p)))
    }
}

/// Places points at even distances along a closed polygon.
fn even_points(corners: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
    let side = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        (a, [b[0] - a[0], b[1] - a[1]])
    };
    let length = |i: usize| {
        let (_, d) = side(i);
        d[0].hypot(d[1])
    };
    let perimeter: f64 = (0..corners.len()).map(length).sum();
    let (mut i, mut passed) = (0, 0.0);
    let point = |k: usize| {
        let target = perimeter * (k as f64 + 0.5) / count as f64;
        while i + 1 < corners.len() && passed + length(i) < target {
            passed += length(i);
            i += 1;
        }
        let (a, d) = side(i);
        let fraction = (target - passed) / length(i);
        [a[0] + fraction * d[0], a[1] + fraction * d[1]]
    };
    (0..count).map(point).collect()
}

/// Computes the flow (displacement) of a point by formula 1, from its affinities and the rigid motions.
///
/// Motions are in `units` (m, m, rad), the flow is in m.
fn flow<S: Real>(point: [f64; 2], affinities: &[S], motions: &[S], units: [f64; MOTION]) -> [S; 2] {
    // Subtracting the largest affinity avoids overflow and does not change the softmax.
    let largest = affinities.iter().map(|a| a.value()).fold(f64::NEG_INFINITY, f64::max);
    let (mut sum, mut out) = (S::zero(), [S::zero(); 2]);
    for (affinity, motion) in affinities.iter().zip(motions.chunks_exact(MOTION)) {
        let weight = (*affinity + -largest).exp();
        let angle = motion[2] * units[2];
        let (sin, cos) = (angle.sin(), angle.cos() + -1.0);
        sum += weight;
        out[0] += weight * (motion[0] * units[0] + cos * point[0] - sin * point[1]);
        out[1] += weight * (motion[1] * units[1] + sin * point[0] + cos * point[1]);
    }
    out.map(|v| v / sum)
}

/// Computes the rigid motion (m, m, rad) closest to the flow of points, by least squares.
fn closest_rigid_motion(points: &[[f64; 2]], flows: &[[f64; 2]]) -> [f64; 3] {
    let n = points.len() as f64;
    let mean = |value: &dyn Fn(usize) -> f64| (0..points.len()).map(value).sum::<f64>() / n;
    let p = [0, 1].map(|j| mean(&|i| points[i][j]));
    let q = [0, 1].map(|j| mean(&|i| points[i][j] + flows[i][j]));
    let (mut cross, mut dot) = (0.0, 0.0);
    for (a, f) in points.iter().zip(flows) {
        let (u, v) = ([a[0] - p[0], a[1] - p[1]], [a[0] + f[0] - q[0], a[1] + f[1] - q[1]]);
        cross += u[0] * v[1] - u[1] * v[0];
        dot += u[0] * v[0] + u[1] * v[1];
    }
    let angle = cross.atan2(dot);
    let (sin, cos) = angle.sin_cos();
    [q[0] - cos * p[0] + sin * p[1], q[1] - sin * p[0] - cos * p[1], angle]
}

/// The net: one perceptron for the motions of the bodies, one for the assignment of points to bodies.
#[derive(Debug, Clone)]
pub struct RigidFlow {
    extents: Extents,
    /// Layers from the features of the rod's motion to the motions of the bodies.
    action: Mlp,
    motions: Linear,
    /// Layers from a point and the rod's position to the point's affinity to each body.
    grouping: Mlp,
    affinities: Linear,
    scene: Option<Scene>,
}

impl RigidFlow {
    pub fn new<T: Scalar>(settings: &Settings, extents: Extents, params: &mut Params<T>) -> Self {
        let h = settings.net.hidden;
        RigidFlow {
            extents,
            action: Mlp::new(params, "action", &[extents.condition - ROD_MOTION_WIDTH, h, h]),
            motions: Linear::new(params, "motions", h, BODIES * MOTION),
            grouping: Mlp::new(params, "grouping", &[ROD_POSITION + 2, h / 2, h / 2]),
            affinities: Linear::new(params, "affinities", h / 2, BODIES),
            scene: settings.engine.push_model().map(Scene::new),
        }
    }
}

/// Rod motions in the rows of a batch tile, with the points of each row.
struct Rows<'a, T> {
    rod_motion: &'a [T],
    lanes: usize,
    points: Vec<(Owner, [f64; 2])>,
}

impl<'a, T: Scalar> Rows<'a, T> {
    fn new(scene: &Scene, rod_motion: &'a [T], lanes: usize) -> Self {
        let mut rows = Rows { rod_motion, lanes, points: Vec::new() };
        let indices = (0..rows.count()).flat_map(|t| (0..lanes).map(move |lane| (t, lane)));
        rows.points = indices.flat_map(|(t, lane)| scene.points(rows.row(t, lane).0)).collect();
        rows
    }

    /// Point `k` of the row at time `t` and lane `lane`, with its owner.
    fn point(&self, t: usize, lane: usize, k: usize) -> (Owner, [f64; 2]) {
        self.points[(t * self.lanes + lane) * POINTS + k]
    }

    /// Number of rows (time steps) of the tile.
    fn count(&self) -> usize {
        self.rod_motion.len() / (ROD_MOTION_WIDTH * self.lanes).max(1)
    }

    /// Position and travel of the rod in a row, m, and units of the corrections.
    ///
    /// Units are 0 beyond the end of a trajectory.
    fn row(&self, t: usize, lane: usize) -> ([f64; 2], [f64; 2], [f64; 3]) {
        let value = |k: usize| self.rod_motion[(t * ROD_MOTION_WIDTH + k) * self.lanes + lane].to_f64();
        ([value(0), value(1)], [value(2), value(3)], [value(4), value(5), value(6)])
    }
}

impl Learned for RigidFlow {
    fn is_deterministic(&self) -> bool {
        true
    }

    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let Extents { condition, .. } = self.extents;
        let (time, lanes) = (tile.time, tile.lanes);
        let u = tape.constant(&[time, condition, lanes], tile.u)?;
        let mask = mask_of(tape, &tile)?;
        // Unreachable: settings without a rod are rejected before a net is trained.
        let Some(scene) = &self.scene else {
            return Ok(LossVars { total: zero(tape)?, kl: zero(tape)?, negative_ln_likelihood: zero(tape)? });
        };
        let width = condition - ROD_MOTION_WIDTH;
        let features = tape.slice(u, 1, 0, width)?;
        let position = tape.slice(u, 1, 0, ROD_POSITION)?;
        let rod_motion = tape.slice(u, 1, width, condition)?;
        let rod_motion = tape.value(rod_motion).to_vec();
        let rows = Rows::new(scene, &rod_motion, lanes);
        let h = self.action.forward(tape, p, features)?;
        let motions = self.motions.forward(tape, p, h)?;
        let mut sum: Option<Var> = None;
        for k in 0..POINTS {
            let truth = PointFlow::new(scene, &rows, tile.x, k);
            let point = tape.constant(&[time, 2, lanes], &truth.point)?;
            let input = tape.concat(&[position, point], 1)?;
            let h = self.grouping.forward(tape, p, input)?;
            let affinities = self.affinities.forward(tape, p, h)?;
            let inputs = tape.concat(&[affinities, motions], 1)?;
            let (values, jacobian) = flows_with_jacobian(&rows, k, tape.value(inputs));
            let predicted = tape.external(inputs, 2, &values, &jacobian)?;
            let target = tape.constant(&[time, 2, lanes], &truth.flow)?;
            let error = tape.squared_error(predicted, target)?;
            let error = masked_sum(tape, error, mask)?;
            sum = Some(match sum {
                None => error,
                Some(sum) => tape.add(sum, error)?,
            });
        }
        let nll = match sum {
            Some(sum) => tape.scale(sum, 1.0 / POINTS as f64)?,
            None => zero(tape)?,
        };
        Ok(LossVars { total: nll, kl: zero(tape)?, negative_ln_likelihood: nll })
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let Some(scene) = &self.scene else { return Err(crate::Difference::OtherSystem.into()) };
        let mlp = |mlp: &Mlp| MlpRunner::new(mlp, trained.params, samples, 1);
        let linear = |linear: Linear| LinearRunner::new(linear, trained.params, samples, 1);
        let mut runner = Runner {
            action: mlp(&self.action),
            motions: linear(self.motions),
            grouping: mlp(&self.grouping),
            affinities: linear(self.affinities),
            scene,
            lanes: samples,
        };
        Ok(strides::roll_out(trained, false, task, samples, &mut runner))
    }
}

/// One point of each row, in units of c, and its true flow (displacement), in units of the corrections.
struct PointFlow<T> {
    point: Vec<T>,
    flow: Vec<T>,
}

impl<T: Scalar> PointFlow<T> {
    /// Takes point `k` of all rows, and its true flow for targets `x [time, 3, lane]`.
    fn new(scene: &Scene, rows: &Rows<'_, T>, x: &[T], k: usize) -> Self {
        let (lanes, time) = (rows.lanes, rows.count());
        let zeros = vec![T::ZERO; time * 2 * lanes];
        let mut out = PointFlow { point: zeros.clone(), flow: zeros };
        for t in 0..time {
            for lane in 0..lanes {
                let (_, travel, unit) = rows.row(t, lane);
                let (owner, point) = rows.point(t, lane, k);
                let displacement = [0, 1, 2].map(|j| x[(t * 3 + j) * lanes + lane].to_f64() * unit[j]);
                let flow = match owner {
                    Owner::Object => flow(point, &[0.0], &displacement, [1.0; MOTION]),
                    Owner::Rod => travel,
                    Owner::Table => [0.0; 2],
                };
                for j in 0..2 {
                    let index = (t * 2 + j) * lanes + lane;
                    out.point[index] = T::from_f64(point[j] / scene.c_m);
                    out.flow[index] = T::from_f64(if unit[0] > 0.0 { flow[j] / unit[0] } else { 0.0 });
                }
            }
        }
        out
    }
}

/// Computes flows `[time, 2, lane]` of point `k` and their Jacobian `[time, 2, INPUTS, lane]`.
///
/// `inputs [time, INPUTS, lane]` are the affinities of the point to the bodies, and the motions; flows are
/// displacements in the units of the network's outputs.
fn flows_with_jacobian<T: Scalar>(rows: &Rows<'_, T>, k: usize, inputs: &[T]) -> (Vec<T>, Vec<T>) {
    let (lanes, time) = (rows.lanes, rows.count());
    let mut values = vec![T::ZERO; time * 2 * lanes];
    let mut jacobian = vec![T::ZERO; time * 2 * INPUTS * lanes];
    for t in 0..time {
        for lane in 0..lanes {
            let (_, _, unit) = rows.row(t, lane);
            if unit[0] <= 0.0 {
                continue;
            }
            let (_, point) = rows.point(t, lane, k);
            let variable =
                |i: usize| Dual::<INPUTS>::variable(inputs[(t * INPUTS + i) * lanes + lane].to_f64(), i);
            let duals: [Dual<INPUTS>; INPUTS] = std::array::from_fn(variable);
            let flow = flow(point, &duals[..BODIES], &duals[BODIES..], [unit[0], unit[0], unit[2]]);
            for (j, flow) in flow.iter().enumerate() {
                values[(t * 2 + j) * lanes + lane] = T::from_f64(flow.value / unit[0]);
                for (i, d) in flow.d.iter().enumerate() {
                    jacobian[((t * 2 + j) * INPUTS + i) * lanes + lane] = T::from_f64(d / unit[0]);
                }
            }
        }
    }
    (values, jacobian)
}

struct Runner<'a> {
    action: MlpRunner,
    motions: LinearRunner,
    grouping: MlpRunner,
    affinities: LinearRunner,
    scene: &'a Scene,
    lanes: usize,
}

impl CorrectionSampler for Runner<'_> {
    fn needs_rod_motion(&self) -> bool {
        true
    }

    fn sample(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let lanes = self.lanes;
        let (features, rod_motion) = u.split_at(u.len() - ROD_MOTION_WIDTH * lanes);
        let motions = self.motions.run(self.action.run(features, 1), 1).to_vec();
        let mut flows = vec![Vec::with_capacity(OBJECT_POINTS); lanes];
        let mut input = features[..ROD_POSITION * lanes].to_vec();
        input.resize((ROD_POSITION + 2) * lanes, 0.0);
        let unit = |k: usize, lane: usize| f64::from(rod_motion[(4 + k) * lanes + lane]);
        for point in &self.scene.outline {
            for (j, row) in input[ROD_POSITION * lanes..].chunks_exact_mut(lanes).enumerate() {
                row.fill((point[j] / self.scene.c_m) as f32);
            }
            let affinities = self.affinities.run(self.grouping.run(&input, 1), 1);
            for (lane, flows) in flows.iter_mut().enumerate() {
                let value = |rows: &[f32], i: usize| f64::from(rows[i * lanes + lane]);
                let affinities: [f64; BODIES] = std::array::from_fn(|i| value(affinities, i));
                let motions: [f64; BODIES * MOTION] = std::array::from_fn(|i| value(&motions, i));
                let units = [unit(0, lane), unit(0, lane), unit(2, lane)];
                flows.push(flow(*point, &affinities, &motions, units));
            }
        }
        for (lane, flows) in flows.iter().enumerate() {
            let motion = closest_rigid_motion(&self.scene.outline, flows);
            (0..3).for_each(|j| out[j * lanes + lane] = (motion[j] / unit(j, lane)) as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: rigid motions are recovered from flows, points are evenly spaced, and the Jacobian is right.
    use super::*;

    #[test]
    fn a_rigid_motion_is_recovered_from_its_flow() {
        let square = [[-0.04, -0.03], [0.04, -0.03], [0.04, 0.03], [-0.04, 0.03]];
        let points = even_points(&square, 16);
        let motion = [0.003, -0.001, 0.2];
        let flows: Vec<[f64; 2]> = points.iter().map(|p| flow(*p, &[0.0], &motion, [1.0; 3])).collect();
        let found = closest_rigid_motion(&points, &flows);
        assert!(found.iter().zip(&motion).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let gap = |i: usize| (points[i][0] - points[i + 1][0]).hypot(points[i][1] - points[i + 1][1]);
        // 0.28 m in 16 parts; distances across a corner are shorter.
        assert!((0..15).all(|i| gap(i) < 0.0175 + 1e-12 && gap(i) > 0.0175 / 1.5), "{points:?}");
    }

    #[test]
    fn the_jacobian_of_a_flow_agrees_with_finite_differences() {
        let inputs: [f64; INPUTS] = std::array::from_fn(|i| 0.3 * (i as f64 * 1.7).sin());
        let flow_at = |x: &[f64; INPUTS]| flow([0.03, -0.02], &x[..BODIES], &x[BODIES..], [0.01, 0.01, 0.2]);
        let dual: [Dual<INPUTS>; INPUTS] = std::array::from_fn(|i| Dual::variable(inputs[i], i));
        let with_jacobian = flow([0.03, -0.02], &dual[..BODIES], &dual[BODIES..], [0.01, 0.01, 0.2]);
        for i in 0..INPUTS {
            let shifted = |sign: f64| {
                let mut x = inputs;
                x[i] += sign * 1e-5;
                flow_at(&x)
            };
            let (up, down) = (shifted(1.0), shifted(-1.0));
            for j in 0..2 {
                let expected = (up[j] - down[j]) / 2e-5;
                assert!((with_jacobian[j].d[i] - expected).abs() < 1e-9, "{i} {j}");
            }
        }
    }
}
