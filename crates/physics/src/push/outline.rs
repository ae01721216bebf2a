//! The outline of an object and the point of it that is closest to the rod.
//!
//! The closest point decides the contact: inside an edge the normal is the edge's, at a vertex it turns with the rod, so that
//! rounding a corner needs no rule of its own. Concave outlines are taken with one contact, the closest.

use super::planar::{Vector, add, constant, cross, dot, norm, scale, sub};
use crate::Scalar;

/// A rod closer than this to a vertex takes the normal of an edge, m.
const COINCIDENT: f64 = 1e-12;

/// One side of a polygon.
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
    convex: bool,
}

impl Polygon {
    /// Polygon of `vertices`, m. Clockwise ones are reversed; a repeated vertex (also the last one equal to the first) counts
    /// once. `None` for fewer than three vertices or no area.
    pub fn new(vertices: &[Vector<f64>]) -> Option<Self> {
        let mut kept: Vec<Vector<f64>> = Vec::with_capacity(vertices.len());
        for &v in vertices {
            if kept.last() != Some(&v) {
                kept.push(v);
            }
        }
        if kept.len() > 1 && kept.first() == kept.last() {
            kept.pop();
        }
        let n = kept.len();
        let doubled: f64 = (0..n).map(|i| cross(kept[i], kept[(i + 1) % n])).sum();
        let finite = kept.iter().flatten().all(|x| x.is_finite());
        if n < 3 || !finite || doubled.abs() < 1e-12 {
            return None;
        }
        if doubled < 0.0 {
            kept.reverse();
        }
        let edges: Vec<Edge> = (0..n)
            .map(|i| {
                let along = sub(kept[(i + 1) % n], kept[i]);
                let length = norm(along);
                let direction = scale(along, 1.0 / length);
                Edge { start: kept[i], direction, normal: [direction[1], -direction[0]], length }
            })
            .collect();
        let convex = (0..n).all(|i| cross(edges[i].direction, edges[(i + 1) % n].direction) >= -1e-9);
        Some(Self { vertices: kept, edges, convex })
    }

    /// Vertices, m, counter-clockwise.
    pub fn vertices(&self) -> &[Vector<f64>] {
        &self.vertices
    }

    /// Copies the polygon with every vertex moved by `by`, m.
    pub fn moved(&self, by: Vector<f64>) -> Self {
        let mut moved = self.clone();
        moved.vertices.iter_mut().for_each(|v| *v = add(*v, by));
        moved.edges.iter_mut().for_each(|e| e.start = add(e.start, by));
        moved
    }

    fn contains(&self, p: Vector<f64>) -> bool {
        if self.convex {
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

    /// The edge closest to `p` and where along it the closest point lies, m.
    fn search(&self, p: Vector<f64>) -> (usize, f64) {
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

    fn nearest<S: Scalar>(&self, p: Vector<S>) -> Nearest<S> {
        let value = p.map(S::value);
        let (index, along) = self.search(value);
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
        if distance.value() < COINCIDENT {
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
    /// The closest point, body frame, m.
    pub point: Vector<S>,
    /// Outward unit normal there.
    pub outward: Vector<S>,
    /// Distance, m; negative inside.
    pub distance: S,
    /// The side that holds the closest point (at a vertex, one of its two); 0 for an ellipse.
    pub edge: usize,
}

/// The outline of an object in its body frame, whose origin is the area centroid.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// A polygon.
    Polygon(Polygon),
    /// An ellipse with its semi-axes along x and y, m.
    Ellipse {
        /// Semi-axes, m.
        semi_axes_m: Vector<f64>,
    },
}

impl Outline {
    /// The closest point of the outline to `p`, body frame.
    #[inline]
    pub fn nearest<S: Scalar>(&self, p: Vector<S>) -> Nearest<S> {
        match self {
            Outline::Polygon(polygon) => polygon.nearest(p),
            Outline::Ellipse { semi_axes_m } => nearest_on_ellipse(*semi_axes_m, p),
        }
    }

    /// The outline as a polygon; an ellipse becomes one with `sides` sides and the same area.
    pub fn polygon(&self, sides: usize) -> Polygon {
        match self {
            Outline::Polygon(polygon) => polygon.clone(),
            Outline::Ellipse { semi_axes_m: [a, b] } => {
                let turn = 2.0 * std::f64::consts::PI / sides.max(3) as f64;
                let swell = (turn / turn.sin()).sqrt();
                let at = |i: usize| {
                    let angle = turn * i as f64;
                    [swell * a * angle.cos(), swell * b * angle.sin()]
                };
                let vertices: Vec<_> = (0..sides.max(3)).map(at).collect();
                Polygon::new(&vertices).unwrap_or(Polygon { vertices, edges: Vec::new(), convex: true })
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

/// Closest point of an ellipse: iteration on the centre of curvature for the value (it converges from any start), two Newton
/// steps for the last digits and one in `S` for the derivative.
fn nearest_on_ellipse<S: Scalar>([a, b]: Vector<f64>, p: Vector<S>) -> Nearest<S> {
    let value = p.map(S::value);
    let (px, py) = (value[0].abs(), value[1].abs());
    let (mut tx, mut ty) = (std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2);
    for _ in 0..6 {
        let evolute = [(a * a - b * b) * tx.powi(3) / a, (b * b - a * a) * ty.powi(3) / b];
        let radius = norm([a * tx - evolute[0], b * ty - evolute[1]]);
        let q = [px - evolute[0], py - evolute[1]];
        let reach = norm(q).max(1e-300);
        tx = ((q[0] * radius / reach + evolute[0]) / a).clamp(0.0, 1.0);
        ty = ((q[1] * radius / reach + evolute[1]) / b).clamp(0.0, 1.0);
        let length = norm([tx, ty]).max(1e-300);
        (tx, ty) = (tx / length, ty / length);
    }
    let mut angle = ty.copysign(value[1]).atan2(tx.copysign(value[0]));
    for _ in 0..2 {
        angle -= orthogonality([a, b], value, angle) / slope([a, b], value, angle);
    }
    let angle = S::constant(angle)
        - orthogonality([a, b], p, S::constant(angle)) * (1.0 / slope([a, b], value, angle));
    let (cos, sin) = (angle.cos(), angle.sin());
    let point = [cos * a, sin * b];
    let normal = [cos * b, sin * a];
    let outward = scale(normal, S::constant(1.0) / norm(normal));
    Nearest { point, outward, distance: dot(sub(p, point), outward), edge: 0 }
}

/// `(q - p)·dq/dφ` for `q = (a cos φ, b sin φ)`: zero at the closest point.
fn orthogonality<S: Scalar>([a, b]: Vector<f64>, p: Vector<S>, angle: S) -> S {
    let (cos, sin) = (angle.cos(), angle.sin());
    dot([cos * a - p[0], sin * b - p[1]], [sin * -a, cos * b])
}

/// Derivative of [`orthogonality`] with respect to the angle.
fn slope([a, b]: Vector<f64>, p: Vector<f64>, angle: f64) -> f64 {
    let (cos, sin) = (angle.cos(), angle.sin());
    let tangent = [-a * sin, b * cos];
    dot(tangent, tangent) + dot([a * cos - p[0], b * sin - p[1]], [-a * cos, -b * sin])
}
