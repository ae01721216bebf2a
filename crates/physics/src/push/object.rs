//! The objects of the MIT Push set.
//!
//! Sizes and masses: Yu, Bauza, Fazeli and Rodriguez, "More than a Million Ways to Be Pushed", IROS 2016,
//! table III, with the digits of the shape list that comes with the data. The body frame used here has its
//! origin at the area centroid; the frames tracked in the recordings of the triangles do not
//! ([`Object::tracked_origin_m`]).

use super::moments::{Moments, mean_radius};
use super::outline::{Outline, Polygon};
use super::planar::Vector;

/// An object that can be pushed.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name of the object.
    pub name: String,
    /// Outline of the object in the body frame, whose origin is the area centroid.
    pub outline: Outline,
    /// Mass of the object, kg; `None` if unknown.
    pub mass_kg: Option<f64>,
    /// Origin of the frame that the recordings track, relative to the area centroid, m.
    pub tracked_origin_m: Vector<f64>,
}

/// Names of the built-in objects.
pub const OBJECTS: [&str; 10] =
    ["rect1", "rect2", "rect3", "tri1", "tri2", "tri3", "ellip1", "ellip2", "ellip3", "hex"];

impl Object {
    /// The built-in object of this name; `None` if there is none.
    ///
    /// The eleventh object of the MIT set, `butter`, is not built in because its outline has 636 points; pass
    /// it to [`Object::polygon`].
    ///
    /// ```
    /// use augsim_physics::push::Object;
    /// let square = Object::named("rect1").expect("built in");
    /// assert_eq!(square.sides(), 4);
    /// assert!(Object::named("teapot").is_none());
    /// ```
    pub fn named(name: &str) -> Option<Self> {
        let rectangle = |a: f64, b: f64| {
            let (x, y) = (a / 2.0, b / 2.0);
            vec![[x, y], [-x, y], [-x, -y], [x, -y]]
        };
        let triangle = |along_y: f64, along_x: f64| {
            let d = 0.045;
            vec![[d, d], [d - along_x, d], [d, d - along_y]]
        };
        let hexagon = || {
            let vertex = |i: usize| {
                let angle = std::f64::consts::FRAC_PI_3 * i as f64;
                [0.0605 * angle.cos(), 0.0605 * angle.sin()]
            };
            (0..6).map(vertex).collect()
        };
        let (vertices, mass_kg) = match name {
            "rect1" => (rectangle(0.09, 0.09), 0.8374),
            "rect2" => (rectangle(0.08991, 0.11258), 1.045),
            "rect3" => (rectangle(0.13501, 0.08994), 1.2508),
            "tri1" => (triangle(0.12587, 0.1259), 0.8028),
            "tri2" => (triangle(0.12587, 0.151), 0.9826),
            "tri3" => (triangle(0.12561, 0.1765), 1.1326),
            "hex" => (hexagon(), 0.9827),
            "ellip1" => return Some(Self::ellipse(name, 0.0525, 0.0525, 0.8937)),
            "ellip2" => return Some(Self::ellipse(name, 0.0525, 0.065445, 1.1104)),
            "ellip3" => return Some(Self::ellipse(name, 0.0525, 0.0785, 1.3338)),
            _ => return None,
        };
        let mut object = Self::polygon(name, &vertices)?;
        object.mass_kg = Some(mass_kg);
        Some(object)
    }

    /// An object with a polygonal outline, shifted so that its area centroid is the origin.
    ///
    /// The vertices, m, may be given in any frame. Returns `None` for fewer than three vertices or no area.
    pub fn polygon(name: &str, vertices: &[Vector<f64>]) -> Option<Self> {
        let polygon = Polygon::new(vertices)?;
        let centroid = Moments::of_polygon(polygon.vertices()).centroid_m;
        let origin = centroid.map(|x| -x);
        Some(Self {
            name: name.into(),
            outline: Outline::Polygon(polygon.moved(origin)),
            mass_kg: None,
            tracked_origin_m: origin,
        })
    }

    /// An elliptic object with semi-axes `a` along x and `b` along y, m.
    fn ellipse(name: &str, a: f64, b: f64, mass_kg: f64) -> Self {
        Self {
            name: name.into(),
            outline: Outline::Ellipse { semi_axes_m: [a, b] },
            mass_kg: Some(mass_kg),
            tracked_origin_m: [0.0; 2],
        }
    }

    /// Length `c` of the ellipsoidal limit surface under uniform pressure, m.
    pub fn uniform_c_m(&self) -> f64 {
        mean_radius(&self.outline)
    }

    /// Number of sides of the outline; 1 for an ellipse.
    pub fn sides(&self) -> usize {
        match &self.outline {
            Outline::Polygon(polygon) => polygon.vertices().len(),
            Outline::Ellipse { .. } => 1,
        }
    }

    /// Point at `fraction` of the outline's side `side`, and the outward unit normal there, body frame.
    ///
    /// Side `i` of a polygon runs from vertex `i` to the next, counter-clockwise. An ellipse has one side,
    /// its perimeter, on which `fraction` counts the angle parameter. Fractions outside 0 to 1 are on the
    /// extension of the side.
    pub fn point_on_side(&self, side: usize, fraction: f64) -> (Vector<f64>, Vector<f64>) {
        match &self.outline {
            Outline::Polygon(polygon) => {
                let v = polygon.vertices();
                let (a, b) = (v[side % v.len()], v[(side + 1) % v.len()]);
                let along = [b[0] - a[0], b[1] - a[1]];
                let length = along[0].hypot(along[1]);
                (
                    [a[0] + along[0] * fraction, a[1] + along[1] * fraction],
                    [along[1] / length, -along[0] / length],
                )
            }
            Outline::Ellipse { semi_axes_m: [a, b] } => {
                let angle = 2.0 * std::f64::consts::PI * fraction;
                let normal = [b * angle.cos(), a * angle.sin()];
                let length = normal[0].hypot(normal[1]);
                ([a * angle.cos(), b * angle.sin()], normal.map(|n| n / length))
            }
        }
    }
}
