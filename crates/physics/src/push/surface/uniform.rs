//! The exact limit surface of a uniformly pressed polygon, in closed form.
//!
//! With the rotation centre z, the dissipation is `|ω| <|ρ-z|>`, a sum over the edges (see `moments.rs`), and so are its
//! derivatives: force `sgn(ω) rot90(Σ n_e ΔF)/A` and moment about z `sgn(ω) Σ d ΔF/(3A)`. One square root per vertex and one
//! logarithm per edge. Far from the rotation centre the sums cancel; there the integrand is smooth and a quadrature of degree
//! five is exact to 1e-10.
//!
//! Slopes need no further root or logarithm: with `F(u, d) = ∫ √(d² + u²) du` along an edge, `∂F/∂u = √(d² + u²)` and
//! `∂F/∂d = d ln(u + √(d² + u²))`.

use super::sloped::{Moving, Sloped};
use super::{Matrix, apply};
use crate::Scalar;
use crate::push::moments::{Moments, mean_radius};
use crate::push::outline::{Outline, Polygon};
use crate::push::planar::{Vector, Wrench, constant, cross, dot, norm, rot90, scale, sub};

/// Ratio of footprint radius to distance of the rotation centre below which the quadrature is used.
const NEAR_TRANSLATION: f64 = 1e-2;

/// A polygon with what its limit surface needs.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformPolygon {
    vertices: Vec<Vector<f64>>,
    edges: Vec<Edge>,
    area: f64,
    radius: f64,
    mean_radius: f64,
    /// Points and shares of the area.
    quadrature: Vec<(Vector<f64>, f64)>,
}

/// An edge from a vertex to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Edge {
    /// Unit vector along it.
    along: Vector<f64>,
    /// Signed distance of the origin, and places of both ends along it, m.
    distance: f64,
    ends: [f64; 2],
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
    /// The footprint `polygon`, about the centre of friction.
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

    /// Mean distance from the centre, m.
    pub fn mean_radius(&self) -> f64 {
        self.mean_radius
    }

    /// See [`Surface::wrench`](super::Surface::wrench).
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

    /// The wrench of `twist` (velocity, rotation) with its slopes, without a map.
    pub(super) fn sloped(&self, twist: [f64; 3]) -> Sloped<3> {
        let [x, y, rotation] = twist;
        let speed = norm([x, y]);
        let mut w = Sloped::zero();
        if rotation.abs() * self.radius <= NEAR_TRANSLATION * speed {
            if speed > 0.0 {
                for &(point, share) in &self.quadrature {
                    let moving = Moving::new(rot90(point), 0.0, twist);
                    let square = moving.square();
                    let k = share / square.sqrt();
                    w.add_patch(&moving, [k, -0.5 * k / square]);
                }
            }
            return w;
        }
        let Some(last) = self.edges.last() else { return w };
        let centre = scale(rot90([x, y]), 1.0 / rotation);
        // Sums over the edges, and their slopes in both coordinates of the centre.
        let (mut sum, mut about_centre) = ([0.0; 2], 0.0);
        let (mut sum_slopes, mut about_slopes) = ([[0.0; 2]; 2], [0.0; 2]);
        let mut from = norm(sub(last.end, centre));
        for edge in &self.edges {
            let to = norm(sub(edge.end, centre));
            let e = edge.along;
            let (d, before) = (edge.distance - cross(centre, e), dot(centre, e));
            let [u1, u2] = edge.ends.map(|u| u - before);
            let (mut integral, mut d_slope) = (u2 * to - u1 * from, 0.0);
            if d.abs() > 1e-9 * self.radius {
                let square = d * d;
                let end = |u: f64, r: f64| if u >= 0.0 { u + r } else { square / (r - u) };
                let log = (end(u2, to) / end(u1, from)).ln();
                integral += square * log;
                d_slope = d * log;
            }
            integral *= 0.5;
            let slopes = [0, 1].map(|k| (from - to) * e[k] + d_slope * [-e[1], e[0]][k]);
            sum = [sum[0] + e[1] * integral, sum[1] - e[0] * integral];
            about_centre += d * integral;
            for k in 0..2 {
                sum_slopes[0][k] += e[1] * slopes[k];
                sum_slopes[1][k] -= e[0] * slopes[k];
                about_slopes[k] += [-e[1], e[0]][k] * integral + d * slopes[k];
            }
            from = to;
        }
        let sign = rotation.signum() / self.area;
        let force = scale(rot90(sum), sign);
        w.values = [force[0], force[1], about_centre * (sign / 3.0) + cross(centre, force)];
        let force_slopes = [sum_slopes[1].map(|s| -s * sign), sum_slopes[0].map(|s| s * sign)];
        let moment_slopes = [0, 1].map(|k| {
            let moved = [force[1], -force[0]][k];
            let turned = centre[0] * force_slopes[1][k] - centre[1] * force_slopes[0][k];
            about_slopes[k] * (sign / 3.0) + moved + turned
        });
        let inverse = 1.0 / rotation;
        for (to, of_centre) in w.slopes.iter_mut().zip([force_slopes[0], force_slopes[1], moment_slopes]) {
            // The centre is (-y, x) / rotation.
            *to = [of_centre[1] * inverse, -of_centre[0] * inverse, -dot(of_centre, centre) * inverse];
        }
        w
    }

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

/// Seven-point rule of degree five on the triangles from the centre to each edge (Radon 1948). A triangle outside a concave
/// polygon counts negative.
fn quadrature(vertices: &[Vector<f64>], area: f64) -> Vec<(Vector<f64>, f64)> {
    let root = 15_f64.sqrt();
    let (near, far) = ((6.0 - root) / 21.0, (6.0 + root) / 21.0);
    let (near_share, far_share) = ((155.0 - root) / 1200.0, (155.0 + root) / 1200.0);
    let mut points = Vec::with_capacity(7 * vertices.len());
    for (i, &a) in vertices.iter().enumerate() {
        let b = vertices[(i + 1) % vertices.len()];
        let share = cross(a, b) / (2.0 * area);
        let mut push = |wa: f64, wb: f64, weight: f64| {
            points.push(([wa * a[0] + wb * b[0], wa * a[1] + wb * b[1]], weight * share));
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
