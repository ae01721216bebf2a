//! Outlines of objects, and the point of an outline that is closest to the rod.
//!
//! The closest point determines the contact. Inside an edge the contact normal is that of the edge; at a
//! vertex it points to the rod, so that moving around a corner needs no special case. A concave outline also
//! has a single contact, at the closest point.

use super::planar::{Vector, add, constant, cross, dot, norm, scale, sub};
use crate::Scalar;

/// Distance from a vertex, m, below which the normal of an edge is used.
///
/// The direction from the vertex to the rod is undefined there.
const VERTEX_TOLERANCE_M: f64 = 1e-12;

/// One side of a polygon, from a vertex to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Edge {
    start: Vector<f64>,
    direction: Vector<f64>,
    normal: Vector<f64>,
    length: f64,
}

/// A simple polygon, counter-clockwise, in the body frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<Vector<f64>>,
    edges: Vec<Edge>,
    is_convex: bool,
}

impl Polygon {
    /// The polygon with these `vertices`, m.
    ///
    /// Clockwise vertices are reversed. Consecutive equal vertices count once, also if the last equals the
    /// first. Returns `None` for fewer than three vertices, numbers that are not finite, or no area.
    pub fn new(vertices: &[Vector<f64>]) -> Option<Self> {
        let mut distinct: Vec<Vector<f64>> = Vec::with_capacity(vertices.len());
        for &v in vertices {
            if distinct.last() != Some(&v) {
                distinct.push(v);
            }
        }
        if distinct.len() > 1 && distinct.first() == distinct.last() {
            distinct.pop();
        }
        let n = distinct.len();
        let doubled_area: f64 = (0..n).map(|i| cross(distinct[i], distinct[(i + 1) % n])).sum();
        let finite = distinct.iter().flatten().all(|x| x.is_finite());
        if n < 3 || !finite || doubled_area.abs() < 1e-12 {
            return None;
        }
        if doubled_area < 0.0 {
            distinct.reverse();
        }
        let edges: Vec<Edge> = (0..n)
            .map(|i| {
                let along = sub(distinct[(i + 1) % n], distinct[i]);
                let length = norm(along);
                let direction = scale(along, 1.0 / length);
                Edge { start: distinct[i], direction, normal: [direction[1], -direction[0]], length }
            })
            .collect();
        let is_convex = (0..n).all(|i| cross(edges[i].direction, edges[(i + 1) % n].direction) >= -1e-9);
        Some(Self { vertices: distinct, edges, is_convex })
    }

    /// Vertices of the polygon, m, counter-clockwise.
    pub fn vertices(&self) -> &[Vector<f64>] {
        &self.vertices
    }

    /// The polygon with every vertex shifted by `by`, m.
    pub fn moved(&self, by: Vector<f64>) -> Self {
        let mut moved = self.clone();
        moved.vertices.iter_mut().for_each(|v| *v = add(*v, by));
        moved.edges.iter_mut().for_each(|e| e.start = add(e.start, by));
        moved
    }

    /// Whether `p` is inside the polygon: by half-planes if it is convex, else by ray casting.
    fn contains(&self, p: Vector<f64>) -> bool {
        if self.is_convex {
            return self.edges.iter().all(|e| dot(sub(p, e.start), e.normal) <= 0.0);
        }
        let n = self.vertices.len();
        let mut inside = false;
        for i in 0..n {
            let (a, b) = (self.vertices[i], self.vertices[(i + 1) % n]);
            if (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1]) {
                inside = !inside;
            }
        }
        inside
    }

    /// Index of the edge closest to `p`, and the position of the closest point along that edge, m.
    fn closest_edge(&self, p: Vector<f64>) -> (usize, f64) {
        let mut best = (0, 0.0, f64::INFINITY);
        for (i, edge) in self.edges.iter().enumerate() {
            let w = sub(p, edge.start);
            let along = dot(w, edge.direction).clamp(0.0, edge.length);
            let off = sub(w, scale(edge.direction, along));
            let square = dot(off, off);
            if square < best.2 {
                best = (i, along, square);
            }
        }
        (best.0, best.1)
    }

    /// The closest point of the polygon to `p`, with derivatives.
    fn nearest<S: Scalar>(&self, p: Vector<S>) -> Nearest<S> {
        let value = p.map(S::value);
        let (index, along) = self.closest_edge(value);
        let edge = &self.edges[index];
        if along > 0.0 && along < edge.length {
            let w = sub(p, constant(edge.start));
            let along = dot(w, constant(edge.direction));
            return Nearest {
                point: add(constant(edge.start), scale(constant(edge.direction), along)),
                outward: constant(edge.normal),
                distance: dot(w, constant(edge.normal)),
                edge: index,
            };
        }
        let vertex = if along > 0.0 { (index + 1) % self.vertices.len() } else { index };
        let point = constant(self.vertices[vertex]);
        let off = sub(p, point);
        let distance = norm(off);
        if distance.value() < VERTEX_TOLERANCE_M {
            let outward = constant(edge.normal);
            return Nearest { point, outward, distance: dot(off, outward), edge: index };
        }
        let sign = if self.contains(value) { -1.0 } else { 1.0 };
        Nearest {
            point,
            outward: scale(off, S::constant(sign) / distance),
            distance: distance * sign,
            edge: index,
        }
    }
}

/// The point of an outline that is closest to a given point.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<S> {
    /// Closest point of the outline, body frame, m.
    pub point: Vector<S>,
    /// Outward unit normal of the outline at the closest point.
    pub outward: Vector<S>,
    /// Signed distance of the given point from the outline, m; negative inside.
    pub distance: S,
    /// Index of the side with the closest point (at a vertex, one of its two sides); 0 for an ellipse.
    pub edge: usize,
}

/// The outline of an object in its body frame, whose origin is the area centroid.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// Outline that is a polygon.
    Polygon(Polygon),
    /// Outline that is an ellipse with semi-axes along x and y.
    Ellipse {
        /// Semi-axes of the ellipse along x and y, m.
        semi_axes_m: Vector<f64>,
    },
}

impl Outline {
    /// The closest point of the outline to `p`, in the body frame.
    #[inline]
    pub fn nearest<S: Scalar>(&self, p: Vector<S>) -> Nearest<S> {
        match self {
            Outline::Polygon(polygon) => polygon.nearest(p),
            Outline::Ellipse { semi_axes_m } => nearest_on_ellipse(*semi_axes_m, p),
        }
    }

    /// The outline as a polygon; an ellipse is approximated by `sides` sides with the same area.
    pub fn polygon(&self, sides: usize) -> Polygon {
        match self {
            Outline::Polygon(polygon) => polygon.clone(),
            Outline::Ellipse { semi_axes_m: [a, b] } => {
                let turn = 2.0 * std::f64::consts::PI / sides.max(3) as f64;
                let enlargement = (turn / turn.sin()).sqrt();
                let vertex = |i: usize| {
                    let angle = turn * i as f64;
                    [enlargement * a * angle.cos(), enlargement * b * angle.sin()]
                };
                let vertices: Vec<_> = (0..sides.max(3)).map(vertex).collect();
                Polygon::new(&vertices).unwrap_or(Polygon { vertices, edges: Vec::new(), is_convex: true })
            }
        }
    }

    /// Largest distance of a point of the outline from the origin, m.
    pub fn radius(&self) -> f64 {
        match self {
            Outline::Polygon(polygon) => polygon.vertices.iter().map(|v| norm(*v)).fold(0.0, f64::max),
            Outline::Ellipse { semi_axes_m: [a, b] } => a.max(*b),
        }
    }
}

/// Closest point of an ellipse with semi-axes `a` and `b` to `p`.
///
/// The value comes from six iterations that replace the ellipse by its circle of curvature (convergent from
/// any start) and two Newton steps for the last digits. One more Newton step in `S` carries the derivatives.
fn nearest_on_ellipse<S: Scalar>([a, b]: Vector<f64>, p: Vector<S>) -> Nearest<S> {
    let value = p.map(S::value);
    let (px, py) = (value[0].abs(), value[1].abs());
    let (mut tx, mut ty) = (std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2);
    for _ in 0..6 {
        let evolute = [(a * a - b * b) * tx.powi(3) / a, (b * b - a * a) * ty.powi(3) / b];
        let radius = norm([a * tx - evolute[0], b * ty - evolute[1]]);
        let q = [px - evolute[0], py - evolute[1]];
        let offset = norm(q).max(1e-300);
        tx = ((q[0] * radius / offset + evolute[0]) / a).clamp(0.0, 1.0);
        ty = ((q[1] * radius / offset + evolute[1]) / b).clamp(0.0, 1.0);
        let length = norm([tx, ty]).max(1e-300);
        (tx, ty) = (tx / length, ty / length);
    }
    let mut angle = ty.copysign(value[1]).atan2(tx.copysign(value[0]));
    for _ in 0..2 {
        angle -= tangential_offset([a, b], value, angle) / tangential_offset_derivative([a, b], value, angle);
    }
    let angle = S::constant(angle)
        - tangential_offset([a, b], p, S::constant(angle))
            * (1.0 / tangential_offset_derivative([a, b], value, angle));
    let (cos, sin) = (angle.cos(), angle.sin());
    let point = [cos * a, sin * b];
    let normal = [cos * b, sin * a];
    let outward = scale(normal, S::constant(1.0) / norm(normal));
    Nearest { point, outward, distance: dot(sub(p, point), outward), edge: 0 }
}

/// Condition of the closest point of an ellipse: `(q - p)·dq/dφ` is zero, `q = (a cos φ, b sin φ)`.
fn tangential_offset<S: Scalar>([a, b]: Vector<f64>, p: Vector<S>, angle: S) -> S {
    let (cos, sin) = (angle.cos(), angle.sin());
    dot([cos * a - p[0], sin * b - p[1]], [sin * -a, cos * b])
}

/// Derivative of [`tangential_offset`] with respect to the angle φ.
fn tangential_offset_derivative([a, b]: Vector<f64>, p: Vector<f64>, angle: f64) -> f64 {
    let (cos, sin) = (angle.cos(), angle.sin());
    let tangent = [-a * sin, b * cos];
    dot(tangent, tangent) + dot([a * cos - p[0], b * sin - p[1]], [-a * cos, -b * sin])
}
