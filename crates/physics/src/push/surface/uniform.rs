//! The exact limit surface of a uniformly pressed polygon, in closed form.
//!
//! With the centre of rotation `z`, `ρ` a point of the footprint and `<>` the mean over its area `A`, the
//! dissipation is
//!
//! ```text
//! D = |ω| <|ρ - z|>        (1)
//! ```
//!
//! Its integral is a sum over the edges (see `moments.rs`), and so are its derivatives. With the outward
//! normal `n_e` of an edge, its signed distance `d` from `z` and the primitive `F` along it,
//!
//! ```text
//! force  = sgn(ω) rot90(Σ n_e ΔF) / A        (2)
//! moment = sgn(ω) Σ d ΔF / (3A)              (3), about z
//! F(u, d) = ∫ √(d² + u²) du                  (4)
//! ```
//!
//! This takes one square root per vertex and one logarithm per edge. The Jacobian needs no more of them,
//! because `∂F/∂u = √(d² + u²)` and `∂F/∂d = d ln(u + √(d² + u²))`.
//!
//! Far from the centre of rotation the sums cancel. There the integrand is smooth, and a quadrature of degree
//! five is exact to 1e-10.

use super::wrench_jacobian::{MovingPatch, WrenchWithJacobian};
use super::{Matrix, apply};
use crate::Scalar;
use crate::push::moments::{Moments, mean_radius};
use crate::push::outline::{Outline, Polygon};
use crate::push::planar::{Vector, Wrench, constant, cross, dot, norm, rot90, scale, sub};

/// Largest ratio of footprint radius to distance of the centre of rotation that uses quadrature.
const NEAR_TRANSLATION: f64 = 1e-2;

/// A uniformly pressed polygon with the precomputed quantities of its limit surface.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformPolygon {
    vertices: Vec<Vector<f64>>,
    edges: Vec<Edge>,
    area: f64,
    radius: f64,
    mean_radius: f64,
    /// Quadrature points in the body frame, m, and their weights, which sum to 1.
    quadrature: Vec<(Vector<f64>, f64)>,
}

/// Edge of the polygon from a vertex to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Edge {
    /// Unit vector along the edge.
    along: Vector<f64>,
    /// Signed distance of the origin from the line of the edge, m.
    distance: f64,
    /// Positions of both ends on the line of the edge, m, from the point closest to the origin.
    ends: [f64; 2],
    /// Vertex at which the edge ends, m.
    end: Vector<f64>,
}

impl Edge {
    fn new(from: Vector<f64>, to: Vector<f64>) -> Self {
        let span = sub(to, from);
        let along = scale(span, 1.0 / norm(span));
        Self { along, distance: cross(from, along), ends: [dot(from, along), dot(to, along)], end: to }
    }
}

impl UniformPolygon {
    /// Precomputes the limit surface of `polygon`, whose origin is the centre of friction.
    pub fn new(polygon: &Polygon) -> Self {
        let vertices = polygon.vertices().to_vec();
        let area = Moments::of_polygon(&vertices).area_m2;
        Self {
            quadrature: quadrature(&vertices, area),
            radius: vertices.iter().map(|v| norm(*v)).fold(0.0, f64::max),
            mean_radius: mean_radius(&Outline::Polygon(polygon.clone())),
            edges: (0..vertices.len())
                .map(|i| Edge::new(vertices[(i + vertices.len() - 1) % vertices.len()], vertices[i]))
                .collect(),
            vertices,
            area,
        }
    }

    /// Mean distance of the polygon's area from the centre of friction, m.
    pub fn mean_radius(&self) -> f64 {
        self.mean_radius
    }

    /// Friction wrench by formulas (2) and (3); see [`Surface::wrench`](super::Surface::wrench).
    pub fn wrench<S: Scalar>(&self, velocity: Vector<S>, rotation: S, map: Option<&Matrix<S>>) -> Wrench<S> {
        let speed = norm(velocity.map(S::value));
        if rotation.value().abs() * self.radius <= NEAR_TRANSLATION * speed {
            return self.near_translation(velocity, rotation, map);
        }
        let inverse = S::constant(1.0) / rotation;
        let centre = scale(rot90(velocity), inverse);
        let place = |v: Vector<f64>| {
            let v = constant(v);
            sub(map.map_or(v, |m| apply(m, v)), centre)
        };
        let (mut sum, mut about_centre) = ([S::zero(); 2], S::zero());
        let Some(&last) = self.vertices.last() else { return Wrench::zero() };
        let mut p = place(last);
        let mut p_length = norm(p);
        for &vertex in &self.vertices {
            let q = place(vertex);
            let q_length = norm(q);
            let along = sub(q, p);
            let length = norm(along);
            let e = scale(along, S::constant(1.0) / length);
            let (d, u1, u2) = (cross(p, e), dot(p, e), dot(q, e));
            let mut integral = u2 * q_length - u1 * p_length;
            if d.value().abs() > 1e-9 * self.radius {
                let square = d * d;
                // u + r without cancellation for negative u, since (r - u)(r + u) = d².
                let end = |u: S, r: S| if u.value() >= 0.0 { u + r } else { square / (r - u) };
                integral += square * (end(u2, q_length) / end(u1, p_length)).ln();
            }
            integral = integral * 0.5;
            // Outward normal of the edge: -rot90(e).
            sum = [sum[0] + e[1] * integral, sum[1] - e[0] * integral];
            about_centre += d * integral;
            (p, p_length) = (q, q_length);
        }
        let sign = rotation.value().signum() / self.area;
        let force = rot90(sum).map(|x| x * sign);
        Wrench { force, moment: about_centre * (sign / 3.0) + cross(centre, force) }
    }

    /// Friction wrench and its Jacobian with respect to `twist` (velocity x, velocity y, rotation).
    ///
    /// Without a map, that is, for isotropic friction.
    pub(super) fn wrench_with_jacobian(&self, twist: [f64; 3]) -> WrenchWithJacobian<3> {
        let [x, y, rotation] = twist;
        let speed = norm([x, y]);
        let mut w = WrenchWithJacobian::zero();
        if rotation.abs() * self.radius <= NEAR_TRANSLATION * speed {
            if speed > 0.0 {
                for &(point, share) in &self.quadrature {
                    let moving = MovingPatch::new(rot90(point), 0.0, twist);
                    let square = moving.square();
                    let k = share / square.sqrt();
                    w.add_patch(&moving, [k, -0.5 * k / square]);
                }
            }
            return w;
        }
        let Some(last) = self.edges.last() else { return w };
        let centre = scale(rot90([x, y]), 1.0 / rotation);
        // Sums over the edges, and their derivatives with respect to both coordinates of the centre of
        // rotation.
        let (mut sum, mut about_centre) = ([0.0; 2], 0.0);
        let (mut sum_derivatives, mut moment_derivatives_about_centre) = ([[0.0; 2]; 2], [0.0; 2]);
        let mut from = norm(sub(last.end, centre));
        for edge in &self.edges {
            let to = norm(sub(edge.end, centre));
            let e = edge.along;
            let (d, shift) = (edge.distance - cross(centre, e), dot(centre, e));
            let [u1, u2] = edge.ends.map(|u| u - shift);
            let (mut integral, mut log_term) = (u2 * to - u1 * from, 0.0);
            if d.abs() > 1e-9 * self.radius {
                let square = d * d;
                let end = |u: f64, r: f64| if u >= 0.0 { u + r } else { square / (r - u) };
                let log = (end(u2, to) / end(u1, from)).ln();
                integral += square * log;
                log_term = d * log;
            }
            integral *= 0.5;
            let derivatives = [0, 1].map(|k| (from - to) * e[k] + log_term * [-e[1], e[0]][k]);
            sum = [sum[0] + e[1] * integral, sum[1] - e[0] * integral];
            about_centre += d * integral;
            for k in 0..2 {
                sum_derivatives[0][k] += e[1] * derivatives[k];
                sum_derivatives[1][k] -= e[0] * derivatives[k];
                moment_derivatives_about_centre[k] += [-e[1], e[0]][k] * integral + d * derivatives[k];
            }
            from = to;
        }
        let sign = rotation.signum() / self.area;
        let force = scale(rot90(sum), sign);
        w.values = [force[0], force[1], about_centre * (sign / 3.0) + cross(centre, force)];
        let force_derivatives = [sum_derivatives[1].map(|s| -s * sign), sum_derivatives[0].map(|s| s * sign)];
        let moment_derivatives = [0, 1].map(|k| {
            let force_part = [force[1], -force[0]][k];
            let arm_part = centre[0] * force_derivatives[1][k] - centre[1] * force_derivatives[0][k];
            moment_derivatives_about_centre[k] * (sign / 3.0) + force_part + arm_part
        });
        let inverse = 1.0 / rotation;
        for (row, by_centre) in
            w.jacobian.iter_mut().zip([force_derivatives[0], force_derivatives[1], moment_derivatives])
        {
            // The chain rule through the centre of rotation (-y, x) / rotation.
            *row = [by_centre[1] * inverse, -by_centre[0] * inverse, -dot(by_centre, centre) * inverse];
        }
        w
    }

    /// Friction wrench of the polygon by quadrature, for motion that is nearly a translation.
    fn near_translation<S: Scalar>(
        &self,
        velocity: Vector<S>,
        rotation: S,
        map: Option<&Matrix<S>>,
    ) -> Wrench<S> {
        let mut w = Wrench::zero();
        if norm(velocity.map(S::value)) <= 0.0 {
            return w;
        }
        for &(point, share) in &self.quadrature {
            let point = constant(point);
            let arm = rot90(map.map_or(point, |m| apply(m, point)));
            let v = [velocity[0] + arm[0] * rotation, velocity[1] + arm[1] * rotation];
            let f = scale(v, S::constant(share) / norm(v));
            w.force = [w.force[0] + f[0], w.force[1] + f[1]];
            w.moment += dot(arm, f);
        }
        w
    }
}

/// Points and weights of a quadrature of degree five over a polygon (seven-point rule of Radon, 1948).
///
/// The rule is applied to the triangle between the origin and each edge. A triangle outside a concave polygon
/// has a negative weight.
fn quadrature(vertices: &[Vector<f64>], area: f64) -> Vec<(Vector<f64>, f64)> {
    let root = 15_f64.sqrt();
    let (near, far) = ((6.0 - root) / 21.0, (6.0 + root) / 21.0);
    let (near_share, far_share) = ((155.0 - root) / 1200.0, (155.0 + root) / 1200.0);
    let mut points = Vec::with_capacity(7 * vertices.len());
    for (i, &a) in vertices.iter().enumerate() {
        let b = vertices[(i + 1) % vertices.len()];
        let area_share = cross(a, b) / (2.0 * area);
        let mut push = |wa: f64, wb: f64, weight: f64| {
            points.push(([wa * a[0] + wb * b[0], wa * a[1] + wb * b[1]], weight * area_share));
        };
        push(1.0 / 3.0, 1.0 / 3.0, 9.0 / 40.0);
        for (w, weight) in [(near, near_share), (far, far_share)] {
            push(w, w, weight);
            push(w, 1.0 - 2.0 * w, weight);
            push(1.0 - 2.0 * w, w, weight);
        }
    }
    points
}
