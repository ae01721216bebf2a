//! Area moments of a footprint, in closed form.
//!
//! The area integral of a function that is homogeneous about the origin is a sum over the edges. For the
//! distance from the origin, with an edge at signed distance `d` from the origin and positions `u₁` to `u₂`
//! along its line,
//!
//! ```text
//! ∫|ρ| dA = Σ d [F(u₂) - F(u₁)] / 3                   (1)
//! F(u) = ½ [u √(d²+u²) + d² asinh(u/|d|)]             (2)
//! ```

use super::outline::{Outline, Polygon};
use super::planar::{Vector, cross, norm, sub};

/// Area, centroid and second moments of a uniform footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Area of the footprint, m².
    pub area_m2: f64,
    /// Centroid of the footprint, m.
    pub centroid_m: Vector<f64>,
    /// Second moments xx, xy and yy about the origin: mean of `ρρᵀ` over the area, m².
    pub second_m2: [f64; 3],
}

impl Moments {
    /// Moments of the polygon with these `vertices`, m, counter-clockwise.
    ///
    /// ```
    /// use augsim_physics::push::Moments;
    /// // A square of 2 m: an area of 4 m², and a mean square radius of (2² + 2²) / 12.
    /// let square = Moments::of_polygon(&[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
    /// assert!((square.area_m2 - 4.0).abs() < 1e-12);
    /// assert!((square.mean_square_radius() - 8.0 / 12.0).abs() < 1e-12);
    /// ```
    pub fn of_polygon(vertices: &[Vector<f64>]) -> Self {
        let n = vertices.len();
        let (mut area, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for i in 0..n {
            let (p, q) = (vertices[i], vertices[(i + 1) % n]);
            let k = cross(p, q);
            area += k / 2.0;
            for axis in 0..2 {
                first[axis] += k * (p[axis] + q[axis]) / 6.0;
            }
            let product = |i: usize, j: usize| {
                k * (2.0 * p[i] * p[j] + 2.0 * q[i] * q[j] + p[i] * q[j] + q[i] * p[j]) / 24.0
            };
            second[0] += product(0, 0);
            second[1] += product(0, 1);
            second[2] += product(1, 1);
        }
        Self { area_m2: area, centroid_m: first.map(|f| f / area), second_m2: second.map(|s| s / area) }
    }

    /// Area moments of an outline.
    pub fn of_outline(outline: &Outline) -> Self {
        match outline {
            Outline::Polygon(polygon) => Self::of_polygon(polygon.vertices()),
            Outline::Ellipse { semi_axes_m: [a, b] } => Self {
                area_m2: std::f64::consts::PI * a * b,
                centroid_m: [0.0; 2],
                second_m2: [a * a / 4.0, 0.0, b * b / 4.0],
            },
        }
    }

    /// Mean square distance from the origin, m². Times the mass it is the moment of inertia.
    pub fn mean_square_radius(&self) -> f64 {
        self.second_m2[0] + self.second_m2[2]
    }
}

/// Mean distance from the origin, m: the `c` of the ellipsoidal limit surface under uniform pressure.
pub fn mean_radius(outline: &Outline) -> f64 {
    match outline {
        Outline::Polygon(polygon) => mean_radius_of_polygon(polygon),
        Outline::Ellipse { semi_axes_m: [a, b] } => {
            // Mean over the polar angle φ of R(φ)³. The trapezoidal rule converges exponentially for a
            // periodic analytic function: 512 points are exact in double precision for any aspect ratio below
            // 5.
            let points = 512;
            let cubes: f64 = (0..points)
                .map(|i| {
                    let angle = 2.0 * std::f64::consts::PI * f64::from(i) / f64::from(points);
                    norm([angle.cos() / a, angle.sin() / b]).powi(-3)
                })
                .sum();
            2.0 * cubes / (3.0 * f64::from(points) * a * b)
        }
    }
}

/// Mean distance from the origin over the area of a polygon, m, by formula (1).
fn mean_radius_of_polygon(polygon: &Polygon) -> f64 {
    let vertices = polygon.vertices();
    let n = vertices.len();
    let mut sum = 0.0;
    for i in 0..n {
        let (p, q) = (vertices[i], vertices[(i + 1) % n]);
        let along = sub(q, p);
        let length = norm(along);
        let d = cross(p, q) / length;
        let u = |v: Vector<f64>| (v[0] * along[0] + v[1] * along[1]) / length;
        // Equation (2).
        let primitive = |u: f64| {
            let log = if d == 0.0 { 0.0 } else { d * d * (u / d.abs()).asinh() };
            0.5 * (u * (d * d + u * u).sqrt() + log)
        };
        sum += d * (primitive(u(q)) - primitive(u(p)));
    }
    sum / (3.0 * Moments::of_polygon(vertices).area_m2)
}
