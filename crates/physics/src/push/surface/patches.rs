//! Limit surface for any distribution of pressure and friction, as a sum over patches of the footprint.
//!
//! Each patch is a small ellipsoidal surface:
//!
//! ```text
//! D = Σ_i w_i √(|v_i|² + c_i² ω²)        (1)
//! ```
//!
//! with `w_i` its share of the sliding force, `v_i` the velocity of its centroid, and `c_i²` half the mean
//! square radius of the patch. This is exact to fourth order in the patch size away from the centre of
//! rotation, and smooth at that centre, where point contacts would make the friction jump.

use super::decay::decay;
use super::wrench_jacobian::{MovingPatch, WrenchWithJacobian};
use super::{Matrix, apply};
use crate::Scalar;
use crate::push::moments::Moments;
use crate::push::outline::{Outline, Polygon};
use crate::push::planar::{Vector, Wrench, constant, dot, rot90};

/// A cell of the footprint, which acts as a small ellipsoidal limit surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Centroid of the patch in the body frame, m.
    pub position: Vector<f64>,
    /// Square of `c` in formula (1): half the mean square radius of the patch, m².
    pub c_squared: f64,
    /// Area of the patch relative to that of the footprint.
    pub share: f64,
}

/// Friction that depends on the sliding speed `v` by the factor `1 + rise exp(-(v/speed)²)`.
#[derive(Clone, Copy, Debug)]
pub struct SpeedLaw<S> {
    /// Relative increase of the friction at rest over that at high speed.
    pub rise: S,
    /// Speed at which the increase of friction has fallen to 37 % (1/e), m/s.
    pub speed_m_s: S,
}

/// Divides an outline into the cells of a grid, `cells` of them across its larger extent.
///
/// An ellipse is approximated by a polygon with 96 sides and the same area.
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
            let cell = clip(vertices, corner, [corner[0] + size[0], corner[1] + size[1]]);
            if cell.len() < 3 {
                continue;
            }
            let m = Moments::of_polygon(&cell);
            if m.area_m2 < 1e-9 * total {
                continue;
            }
            let centroid = m.centroid_m;
            let central_square_radius = (m.mean_square_radius() - dot(centroid, centroid)).max(0.0);
            patches.push(Patch {
                position: centroid,
                c_squared: central_square_radius / 2.0,
                share: m.area_m2 / total,
            });
        }
    }
    patches
}

/// The part of a polygon inside an axis-parallel rectangle.
///
/// Source: Sutherland and Hodgman, Communications of the ACM 17:32, 1974.
fn clip(vertices: &[Vector<f64>], low: Vector<f64>, high: Vector<f64>) -> Vec<Vector<f64>> {
    let mut clipped_vertices = vertices.to_vec();
    for (axis, bound, sign) in [(0, low[0], 1.0), (0, high[0], -1.0), (1, low[1], 1.0), (1, high[1], -1.0)] {
        let inside = |v: &Vector<f64>| sign * (v[axis] - bound);
        let mut next = Vec::with_capacity(clipped_vertices.len() + 4);
        for i in 0..clipped_vertices.len() {
            let (a, b) = (clipped_vertices[i], clipped_vertices[(i + 1) % clipped_vertices.len()]);
            let (da, db) = (inside(&a), inside(&b));
            if da >= 0.0 {
                next.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                let t = da / (da - db);
                next.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        clipped_vertices = next;
    }
    clipped_vertices
}

/// Friction wrench of the patches, summed; see [`Surface::wrench`](super::Surface::wrench).
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
            let ratio = square / (law.speed_m_s * law.speed_m_s);
            let value = decay(ratio.value());
            // Derivatives follow by the chain rule: the difference has the value 0 and those of the ratio.
            let decay = (ratio - ratio.value()) * -value + value;
            k = k * (law.rise * decay + 1.0);
        }
        w.force = [w.force[0] + v[0] * k, w.force[1] + v[1] * k];
        w.moment += (dot(arm, v) + rotation * patch.c_squared) * k;
    }
    w
}

/// Friction wrench and its Jacobian with respect to `twist` (velocity x, velocity y, rotation).
pub(super) fn wrench_with_jacobian(
    patches: &[Patch],
    weights: &[f64],
    twist: [f64; 3],
) -> WrenchWithJacobian<3> {
    let mut w = WrenchWithJacobian::zero();
    for (patch, &weight) in patches.iter().zip(weights) {
        let moving = MovingPatch::new(rot90(patch.position), patch.c_squared, twist);
        let square = moving.square();
        if square > 0.0 {
            let k = weight / square.sqrt();
            w.add_patch(&moving, [k, -0.5 * k / square]);
        }
    }
    w
}

/// Friction wrench of patches whose friction depends on the speed, and its Jacobian.
///
/// The inputs are velocity x, velocity y, rotation, and the rise and speed of the [`SpeedLaw`].
pub(super) fn wrench_with_jacobian_by_speed(
    patches: &[Patch],
    weights: &[f64],
    inputs: [f64; 5],
) -> WrenchWithJacobian<5> {
    let [x, y, rotation, rise, speed_m_s] = inputs;
    let mut w = WrenchWithJacobian::zero();
    for (patch, &weight) in patches.iter().zip(weights) {
        let moving = MovingPatch::new(rot90(patch.position), patch.c_squared, [x, y, rotation]);
        let square = moving.square();
        if square <= 0.0 {
            continue;
        }
        let plain = weight / square.sqrt();
        let ratio = square / (speed_m_s * speed_m_s);
        let decay = decay(ratio);
        let factor = 1.0 + rise * decay;
        let before = w.values;
        let k_derivative = plain * (-0.5 * factor / square - rise * decay / (speed_m_s * speed_m_s));
        w.add_patch(&moving, [plain * factor, k_derivative]);
        // The contribution of the patch is proportional to `factor`, so its derivatives follow by scaling.
        let factor_derivatives = [decay, 2.0 * rise * decay * ratio / speed_m_s];
        for (row, before) in before.into_iter().enumerate() {
            let per_factor = (w.values[row] - before) / factor;
            w.jacobian[row][3] += per_factor * factor_derivatives[0];
            w.jacobian[row][4] += per_factor * factor_derivatives[1];
        }
    }
    w
}

/// Friction wrench of patches whose positions a linear map moves, and its Jacobian.
///
/// The inputs are velocity x, velocity y, rotation, the rise and speed of the [`SpeedLaw`], and the map by rows. Without
/// a law (`has_law`) the rise and the speed have no effect.
pub(super) fn wrench_with_jacobian_of_map(
    patches: &[Patch],
    weights: &[f64],
    inputs: [f64; 9],
    has_law: bool,
) -> WrenchWithJacobian<9> {
    let [x, y, rotation, rise, speed_m_s, xx, xy, yx, yy] = inputs;
    let mut w = WrenchWithJacobian::zero();
    for (patch, &weight) in patches.iter().zip(weights) {
        let p = patch.position;
        let moving =
            MovingPatch::new(rot90(apply(&[[xx, xy], [yx, yy]], p)), patch.c_squared, [x, y, rotation]);
        let square = moving.square();
        if square <= 0.0 {
            continue;
        }
        let plain = weight / square.sqrt();
        let ratio = square / (speed_m_s * speed_m_s);
        let decay = if has_law { decay(ratio) } else { 0.0 };
        let k = plain * (1.0 + rise * decay);
        let k_derivative = -0.5 * k / square - plain * rise * decay / (speed_m_s * speed_m_s);
        w.add_patch(&moving, [k, k_derivative]);
        let by_law = [plain * decay, 2.0 * plain * rise * decay * ratio / speed_m_s];
        let half_gradient = moving.half_gradient();
        let MovingPatch { arm, v, .. } = moving;
        // Derivatives of the half gradient with respect to the arm, and half those of the square.
        let by_arm = [
            ([rotation, 0.0, v[0] + arm[0] * rotation], v[0] * rotation),
            ([0.0, rotation, v[1] + arm[1] * rotation], v[1] * rotation),
        ];
        for (row, jacobian) in w.jacobian.iter_mut().enumerate() {
            jacobian[3] += by_law[0] * half_gradient[row];
            jacobian[4] += by_law[1] * half_gradient[row];
            let [x_arm, y_arm] = by_arm.map(|(direct, half_square)| {
                k * direct[row] + 2.0 * k_derivative * half_gradient[row] * half_square
            });
            // The arm is the mapped position, rotated by 90 degrees.
            let by_map = [y_arm * p[0], y_arm * p[1], -x_arm * p[0], -x_arm * p[1]];
            jacobian[5..].iter_mut().zip(by_map).for_each(|(sum, term)| *sum += term);
        }
    }
    w
}
