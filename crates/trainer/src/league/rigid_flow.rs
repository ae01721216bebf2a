//! SE3-Nets (Byravan, Fox 2017) in the plane, on points instead of images: points on the object's outline, on the rod and on the table
//! are each given softly to one of [`BODIES`] bodies, and each body moves rigidly. No physics takes part, and nothing says which points
//! belong together but how they flow. Trained on the flow of all points over a stride; deterministic, as published.
//!
//! The forecast is the rigid motion nearest to the predicted flow of the outline.

use super::strides::{self, RAW, Steps};
use super::{Class, Extents, Kind, Learned, Plan, Trained, zero};
use crate::engine::ModelPush;
use crate::league::reads::Reads;
use crate::nets::tile::{LossVars, Tile, mask_of, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{LinearRunner, MlpRunner};
use augsim_nn::{Bound, Linear, Mlp, Params};
use augsim_physics::{Dual, Scalar as Real};
use augsim_tensor::{Scalar, Tape, TensorError, Var};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Bodies that points may belong to.
const BODIES: usize = 3;
/// Numbers of a body's motion: way, and turn.
const MOTION: usize = 3;
/// Inputs of the flow of a point: its affinity to each body, and all motions.
const INPUTS: usize = BODIES + BODIES * MOTION;
/// Points on the outline, on the rod's rim and on the table.
const ON_OBJECT: usize = 16;
const ON_ROD: usize = 4;
const ON_TABLE: usize = 4;
const POINTS: usize = ON_OBJECT + ON_ROD + ON_TABLE;
/// Distance of the points on the table from the object's centre, in units of its largest radius.
const TABLE_AWAY: f64 = 2.5;
/// Features of a stride that say where the rod is; they come first.
const ROD_PLACE: usize = 2;

pub(crate) static RIGID_FLOW: Class = Class {
    kind: Kind::RigidFlow,
    reads: Reads::Contacts,
    plan: Plan { hidden: 32, sd_floor: 0.0, learning_rate: 3e-3 },
    pushing_only: true,
};

/// The points of an object, in its own frame, m.
#[derive(Debug, Clone)]
struct Scene {
    outline: Vec<[f64; 2]>,
    table: Vec<[f64; 2]>,
    rod_radius_m: f64,
    /// Unit of lengths that the net reads, m.
    c_m: f64,
}

/// The body that a point truly belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Owner {
    Object,
    Rod,
    Table,
}

impl Scene {
    fn of(push: &ModelPush) -> Self {
        let outline = &push.world().object().outline;
        let corners = outline.polygon(48);
        let corners = corners.vertices();
        let away = TABLE_AWAY * outline.radius();
        let table = (0..ON_TABLE)
            .map(|k| TAU * (k as f64 + 0.5) / ON_TABLE as f64)
            .map(|a| [away * a.cos(), away * a.sin()]);
        Scene {
            outline: evenly(corners, ON_OBJECT),
            table: table.collect(),
            rod_radius_m: push.rod_radius_m(),
            c_m: push.c_m(),
        }
    }

    /// Every point with its owner, for the rod at `rod`.
    fn points(&self, rod: [f64; 2]) -> impl Iterator<Item = (Owner, [f64; 2])> + '_ {
        let rim = (0..ON_ROD).map(move |k| {
            let angle = TAU * k as f64 / ON_ROD as f64;
            [rod[0] + self.rod_radius_m * angle.cos(), rod[1] + self.rod_radius_m * angle.sin()]
        });
        (self.outline.iter().map(|p| (Owner::Object, *p)))
            .chain(rim.map(|p| (Owner::Rod, p)))
            .chain(self.table.iter().map(|p| (Owner::Table, *p)))
    }
}

/// Points along a closed polygon, at even distances.
fn evenly(corners: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
    let side = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        (a, [b[0] - a[0], b[1] - a[1]])
    };
    let length = |i: usize| {
        let (_, d) = side(i);
        d[0].hypot(d[1])
    };
    let whole: f64 = (0..corners.len()).map(length).sum();
    let (mut i, mut before) = (0, 0.0);
    let at = |k: usize| {
        let wanted = whole * (k as f64 + 0.5) / count as f64;
        while i + 1 < corners.len() && before + length(i) < wanted {
            before += length(i);
            i += 1;
        }
        let (a, d) = side(i);
        let share = (wanted - before) / length(i);
        [a[0] + share * d[0], a[1] + share * d[1]]
    };
    (0..count).map(at).collect()
}

/// Flow of a point: the motions of the bodies, weighted by the softmax of its affinities. Motions are in `units` (m, m, rad).
fn flow<S: Real>(point: [f64; 2], affinities: &[S], motions: &[S], units: [f64; MOTION]) -> [S; 2] {
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

/// The rigid motion (m, m, rad) nearest to the flow of points.
fn rigid(points: &[[f64; 2]], flows: &[[f64; 2]]) -> [f64; 3] {
    let n = points.len() as f64;
    let mean = |of: &dyn Fn(usize) -> f64| (0..points.len()).map(of).sum::<f64>() / n;
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

/// The net.
#[derive(Debug, Clone)]
pub struct RigidFlow {
    extents: Extents,
    /// The rod's place and way to the motions of the bodies.
    action: Mlp,
    motions: Linear,
    /// A point and the rod's place to the affinities of the point.
    grouping: Mlp,
    affinities: Linear,
    scene: Option<Scene>,
}

impl RigidFlow {
    pub fn new<T: Scalar>(settings: &Settings, extents: Extents, params: &mut Params<T>) -> Self {
        let h = settings.net.hidden;
        RigidFlow {
            extents,
            action: Mlp::new(params, "action", &[extents.condition - RAW, h, h]),
            motions: Linear::new(params, "motions", h, BODIES * MOTION),
            grouping: Mlp::new(params, "grouping", &[ROD_PLACE + 2, h / 2, h / 2]),
            affinities: Linear::new(params, "affinities", h / 2, BODIES),
            scene: settings.engine.pushing().map(Scene::of),
        }
    }
}

/// A tile's rows as they are read, with the points of each.
struct Rows<'a, T> {
    raw: &'a [T],
    lanes: usize,
    points: Vec<(Owner, [f64; 2])>,
}

impl<'a, T: Scalar> Rows<'a, T> {
    fn new(scene: &Scene, raw: &'a [T], lanes: usize) -> Self {
        let mut rows = Rows { raw, lanes, points: Vec::new() };
        let places = (0..rows.count()).flat_map(|t| (0..lanes).map(move |lane| (t, lane)));
        rows.points = places.flat_map(|(t, lane)| scene.points(rows.row(t, lane).0)).collect();
        rows
    }

    /// Point `k` of a row and the body that it truly belongs to.
    fn point(&self, t: usize, lane: usize, k: usize) -> (Owner, [f64; 2]) {
        self.points[(t * self.lanes + lane) * POINTS + k]
    }

    fn count(&self) -> usize {
        self.raw.len() / (RAW * self.lanes).max(1)
    }

    fn at(&self, t: usize, k: usize, lane: usize) -> f64 {
        self.raw[(t * RAW + k) * self.lanes + lane].to_f64()
    }

    /// The rod's place and way, and the units of the corrections, which are 0 beyond the end of a shorter trajectory.
    fn row(&self, t: usize, lane: usize) -> ([f64; 2], [f64; 2], [f64; 3]) {
        let at = |k: usize| self.at(t, k, lane);
        ([at(0), at(1)], [at(2), at(3)], [at(4), at(5), at(6)])
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
        // Settings without a rod are refused before a net is trained.
        let Some(scene) = &self.scene else {
            return Ok(LossVars { total: zero(tape)?, kl: zero(tape)?, misfit: zero(tape)? });
        };
        let seen = condition - RAW;
        let features = tape.slice(u, 1, 0, seen)?;
        let place = tape.slice(u, 1, 0, ROD_PLACE)?;
        let raw = tape.slice(u, 1, seen, condition)?;
        let raw = tape.value(raw).to_vec();
        let rows = Rows::new(scene, &raw, lanes);
        let h = self.action.forward(tape, p, features)?;
        let motions = self.motions.forward(tape, p, h)?;
        let mut sum: Option<Var> = None;
        for k in 0..POINTS {
            let known = Known::of(scene, &rows, tile.x, k);
            let point = tape.constant(&[time, 2, lanes], &known.point)?;
            let read = tape.concat(&[place, point], 1)?;
            let h = self.grouping.forward(tape, p, read)?;
            let affinities = self.affinities.forward(tape, p, h)?;
            let inputs = tape.concat(&[affinities, motions], 1)?;
            let (values, jacobian) = differentiated(&rows, k, tape.value(inputs));
            let found = tape.external(inputs, 2, &values, &jacobian)?;
            let wanted = tape.constant(&[time, 2, lanes], &known.flow)?;
            let error = tape.squared_error(found, wanted)?;
            let error = masked_sum(tape, error, mask)?;
            sum = Some(match sum {
                None => error,
                Some(sum) => tape.add(sum, error)?,
            });
        }
        let misfit = match sum {
            Some(sum) => tape.scale(sum, 1.0 / POINTS as f64)?,
            None => zero(tape)?,
        };
        Ok(LossVars { total: misfit, kl: zero(tape)?, misfit })
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
        Ok(strides::roll(trained, false, task, samples, &mut runner))
    }
}

/// A point of each row, in units of c, and its true flow, in units of the corrections.
struct Known<T> {
    point: Vec<T>,
    flow: Vec<T>,
}

impl<T: Scalar> Known<T> {
    /// Point `k` of all rows, for targets `x [time, 3, lane]`.
    fn of(scene: &Scene, rows: &Rows<'_, T>, x: &[T], k: usize) -> Self {
        let (lanes, time) = (rows.lanes, rows.count());
        let mut out = Known { point: vec![T::ZERO; time * 2 * lanes], flow: vec![T::ZERO; time * 2 * lanes] };
        for t in 0..time {
            for lane in 0..lanes {
                let (_, travel, unit) = rows.row(t, lane);
                let (owner, point) = rows.point(t, lane, k);
                let moved = [0, 1, 2].map(|j| x[(t * 3 + j) * lanes + lane].to_f64() * unit[j]);
                let flow = match owner {
                    Owner::Object => flow(point, &[0.0], &moved, [1.0; MOTION]),
                    Owner::Rod => travel,
                    Owner::Table => [0.0; 2],
                };
                for j in 0..2 {
                    let at = (t * 2 + j) * lanes + lane;
                    out.point[at] = T::of(point[j] / scene.c_m);
                    out.flow[at] = T::of(if unit[0] > 0.0 { flow[j] / unit[0] } else { 0.0 });
                }
            }
        }
        out
    }
}

/// Flows `[time, 2, lane]` of point `k` in units of the corrections, with the Jacobian `[time, 2, INPUTS, lane]`, for affinities and motions
/// `inputs [time, INPUTS, lane]`.
fn differentiated<T: Scalar>(rows: &Rows<'_, T>, k: usize, inputs: &[T]) -> (Vec<T>, Vec<T>) {
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
            let read: [Dual<INPUTS>; INPUTS] = std::array::from_fn(variable);
            let found = flow(point, &read[..BODIES], &read[BODIES..], [unit[0], unit[0], unit[2]]);
            for (j, found) in found.iter().enumerate() {
                values[(t * 2 + j) * lanes + lane] = T::of(found.value / unit[0]);
                for (i, d) in found.d.iter().enumerate() {
                    jacobian[((t * 2 + j) * INPUTS + i) * lanes + lane] = T::of(d / unit[0]);
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

impl Steps for Runner<'_> {
    fn reads_contacts(&self) -> bool {
        true
    }

    fn draw(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let lanes = self.lanes;
        let (features, raw) = u.split_at(u.len() - RAW * lanes);
        let motions = self.motions.run(self.action.run(features, 1), 1).to_vec();
        let mut flows = vec![Vec::with_capacity(ON_OBJECT); lanes];
        let mut read = features[..ROD_PLACE * lanes].to_vec();
        read.resize((ROD_PLACE + 2) * lanes, 0.0);
        let unit = |k: usize, lane: usize| f64::from(raw[(4 + k) * lanes + lane]);
        for point in &self.scene.outline {
            for (j, place) in read[ROD_PLACE * lanes..].chunks_exact_mut(lanes).enumerate() {
                place.fill((point[j] / self.scene.c_m) as f32);
            }
            let affinities = self.affinities.run(self.grouping.run(&read, 1), 1);
            for (lane, flows) in flows.iter_mut().enumerate() {
                let of = |rows: &[f32], i: usize| f64::from(rows[i * lanes + lane]);
                let affinities: [f64; BODIES] = std::array::from_fn(|i| of(affinities, i));
                let motions: [f64; BODIES * MOTION] = std::array::from_fn(|i| of(&motions, i));
                let units = [unit(0, lane), unit(0, lane), unit(2, lane)];
                flows.push(flow(*point, &affinities, &motions, units));
            }
        }
        for (lane, flows) in flows.iter().enumerate() {
            let moved = rigid(&self.scene.outline, flows);
            (0..3).for_each(|j| out[j * lanes + lane] = (moved[j] / unit(j, lane)) as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the flow of a rigid motion gives that motion back, points lie evenly on the outline, and the flow's slopes are those of
    //! difference quotients.
    use super::*;

    #[test]
    fn the_motion_of_a_rigid_flow_is_found() {
        let square = [[-0.04, -0.03], [0.04, -0.03], [0.04, 0.03], [-0.04, 0.03]];
        let points = evenly(&square, 16);
        let wanted = [0.003, -0.001, 0.2];
        let flows: Vec<[f64; 2]> = points.iter().map(|p| flow(*p, &[0.0], &wanted, [1.0; 3])).collect();
        let found = rigid(&points, &flows);
        assert!(found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let gap = |i: usize| (points[i][0] - points[i + 1][0]).hypot(points[i][1] - points[i + 1][1]);
        // 0.28 m in 16 parts; corners are cut.
        assert!((0..15).all(|i| gap(i) < 0.0175 + 1e-12 && gap(i) > 0.0175 / 1.5), "{points:?}");
    }

    #[test]
    fn slopes_of_a_flow_are_those_of_difference_quotients() {
        let inputs: [f64; INPUTS] = std::array::from_fn(|i| 0.3 * (i as f64 * 1.7).sin());
        let at = |x: &[f64; INPUTS]| flow([0.03, -0.02], &x[..BODIES], &x[BODIES..], [0.01, 0.01, 0.2]);
        let dual: [Dual<INPUTS>; INPUTS] = std::array::from_fn(|i| Dual::variable(inputs[i], i));
        let slopes = flow([0.03, -0.02], &dual[..BODIES], &dual[BODIES..], [0.01, 0.01, 0.2]);
        for i in 0..INPUTS {
            let moved = |sign: f64| {
                let mut x = inputs;
                x[i] += sign * 1e-5;
                at(&x)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            for j in 0..2 {
                let wanted = (up[j] - down[j]) / 2e-5;
                assert!((slopes[j].d[i] - wanted).abs() < 1e-9, "{i} {j}");
            }
        }
    }
}
