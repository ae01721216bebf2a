//! Limit surface of any pressure and any friction, as a sum over patches.
//!
//! Each patch is a small ellipsoidal surface of its own: `D = Σ w_i √(|v_i|² + c_i² ω²)` with `c_i²` half the mean square
//! radius of the patch. That is right to fourth order in the patch size away from the rotation centre, and smooth at it, where
//! point patches would jump.

use super::sloped::{Moving, Sloped};
use super::{Matrix, apply};
use crate::Scalar;
use crate::push::moments::Moments;
use crate::push::outline::{Outline, Polygon};
use crate::push::planar::{Vector, Wrench, constant, dot, rot90};

/// A part of the footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its centroid in the body, m.
    pub position: Vector<f64>,
    /// Square of its own `c`, m².
    pub c_squared: f64,
    /// Its share of the area.
    pub share: f64,
}

/// Friction that is higher at low sliding speed: `1 + rise exp(-(v/speed)²)`.
#[derive(Clone, Copy, Debug)]
pub struct SpeedLaw<S> {
    /// Relative rise at rest.
    pub rise: S,
    /// Speed at which it has gone down to 37 %, m/s.
    pub speed_m_s: S,
}

/// Cuts an outline into the cells of a grid with `cells` cells across its larger extent. An ellipse is cut as a polygon of 96
/// sides with its area.
pub fn cut(outline: &Outline, cells: usize) -> Vec<Patch> {
    let polygon: Polygon = outline.polygon(96);
    let vertices = polygon.vertices();
    let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
        vertices.iter().map(|v| v[axis]).fold(start, pick)
    };
    let low = [0, 1].map(|axis| bound(axis, f64::min, f64::INFINITY));
    let high = [0, 1].map(|axis| bound(axis, f64::max, f64::NEG_INFINITY));
    let pitch = (high[0] - low[0]).max(high[1] - low[1]) / cells.max(1) as f64;
    let count = [0, 1].map(|axis| ((high[axis] - low[axis]) / pitch - 1e-9).ceil().max(1.0) as usize);
    let total = Moments::of_polygon(vertices).area_m2;
    let mut patches = Vec::new();
    for row in 0..count[1] {
        for column in 0..count[0] {
            let size = [0, 1].map(|axis| (high[axis] - low[axis]) / count[axis] as f64);
            let corner = [low[0] + column as f64 * size[0], low[1] + row as f64 * size[1]];
            let cell = clipped(vertices, corner, [corner[0] + size[0], corner[1] + size[1]]);
            if cell.len() < 3 {
                continue;
            }
            let m = Moments::of_polygon(&cell);
            if m.area_m2 < 1e-9 * total {
                continue;
            }
            let centroid = m.centroid_m;
            let spread = (m.mean_square_radius() - dot(centroid, centroid)).max(0.0);
            patches.push(Patch { position: centroid, c_squared: spread / 2.0, share: m.area_m2 / total });
        }
    }
    patches
}

/// Sutherland and Hodgman 1974: the part of a polygon inside an axis-parallel rectangle.
fn clipped(vertices: &[Vector<f64>], low: Vector<f64>, high: Vector<f64>) -> Vec<Vector<f64>> {
    let mut kept = vertices.to_vec();
    for (axis, bound, sign) in [(0, low[0], 1.0), (0, high[0], -1.0), (1, low[1], 1.0), (1, high[1], -1.0)] {
        let inside = |v: &Vector<f64>| sign * (v[axis] - bound);
        let mut next = Vec::with_capacity(kept.len() + 4);
        for i in 0..kept.len() {
            let (a, b) = (kept[i], kept[(i + 1) % kept.len()]);
            let (da, db) = (inside(&a), inside(&b));
            if da >= 0.0 {
                next.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                let t = da / (da - db);
                next.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        kept = next;
    }
    kept
}

/// See [`Surface::wrench`](super::Surface::wrench).
pub fn wrench<S: Scalar>(
    patches: &[Patch],
    weights: &[f64],
    velocity: Vector<S>,
    rotation: S,
    map: Option<&Matrix<S>>,
    speed_law: Option<&SpeedLaw<S>>,
) -> Wrench<S> {
    let mut w = Wrench::zero();
    let turning = rotation * rotation;
    for (patch, &weight) in patches.iter().zip(weights) {
        let position = constant(patch.position);
        let arm = rot90(map.map_or(position, |m| apply(m, position)));
        let v = [velocity[0] + arm[0] * rotation, velocity[1] + arm[1] * rotation];
        let square = dot(v, v) + turning * patch.c_squared;
        if square.value() <= 0.0 {
            continue;
        }
        let mut k = S::constant(weight) / square.sqrt();
        if let Some(law) = speed_law {
            let decay = -(square / (law.speed_m_s * law.speed_m_s));
            k = k * (law.rise * decay.exp() + 1.0);
        }
        w.force = [w.force[0] + v[0] * k, w.force[1] + v[1] * k];
        w.moment += (dot(arm, v) + rotation * patch.c_squared) * k;
    }
    w
}

/// The wrench of `twist` (velocity, rotation) with its slopes.
pub(super) fn sloped(patches: &[Patch], weights: &[f64], twist: [f64; 3]) -> Sloped<3> {
    let mut w = Sloped::zero();
    for (patch, &weight) in patches.iter().zip(weights) {
        let moving = Moving::new(rot90(patch.position), patch.c_squared, twist);
        let square = moving.square();
        if square > 0.0 {
            let k = weight / square.sqrt();
            w.add_patch(&moving, [k, -0.5 * k / square]);
        }
    }
    w
}

/// The wrench of a twist with its slopes under a speed law, whose rise and speed are the fourth and the fifth input.
pub(super) fn sloped_by_speed(patches: &[Patch], weights: &[f64], inputs: [f64; 5]) -> Sloped<5> {
    let [x, y, rotation, rise, speed_m_s] = inputs;
    let mut w = Sloped::zero();
    for (patch, &weight) in patches.iter().zip(weights) {
        let moving = Moving::new(rot90(patch.position), patch.c_squared, [x, y, rotation]);
        let square = moving.square();
        if square <= 0.0 {
            continue;
        }
        let plain = weight / square.sqrt();
        let ratio = square / (speed_m_s * speed_m_s);
        let decay = (-ratio).exp();
        let factor = 1.0 + rise * decay;
        let before = w.values;
        let k_slope = plain * (-0.5 * factor / square - rise * decay / (speed_m_s * speed_m_s));
        w.add_patch(&moving, [plain * factor, k_slope]);
        // The patch's part is proportional to the factor.
        let of_factor = [decay, 2.0 * rise * decay * ratio / speed_m_s];
        for (row, before) in before.into_iter().enumerate() {
            let part = (w.values[row] - before) / factor;
            w.slopes[row][3] += part * of_factor[0];
            w.slopes[row][4] += part * of_factor[1];
        }
    }
    w
}
