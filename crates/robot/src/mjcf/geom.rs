//! Geoms of an MJCF file, as far as the inertia of their body comes from them.

use std::f64::consts::PI;

use super::orientation::Orientation;
use super::settings::Settings;
use crate::description::{Inertia, Placement};
use crate::error::DescriptionError;
use crate::rotation::{Matrix, add, apply, product, rotate_tensor, subtract};
use crate::xml::Element;

/// Shape of a geom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Sphere,
    Capsule,
    Ellipsoid,
    Cylinder,
    Box,
    /// A plane or a height field, which has no mass.
    Massless,
    /// A mesh or a distance field, whose volume is in another file.
    Mesh,
}

/// Attributes of a geom, from its class and its element.
#[derive(Debug, Clone)]
pub(super) struct GeomValues {
    shape: Shape,
    size: [f64; 3],
    ends: Option<[f64; 6]>,
    position: [f64; 3],
    orientation: Orientation,
    mass: Option<f64>,
    density: f64,
    group: f64,
    is_shell: bool,
    has_mesh: bool,
}

/// Sizes, position and orientation of a geom in the frame of its element.
type Extent = ([f64; 3], [f64; 3], Matrix);

/// Mass of a geom.
pub(super) enum GeomMass {
    /// None.
    Nothing,
    /// This inertia, in the frame of the body.
    Known(Inertia),
    /// One that depends on a mesh, or that is computed from the surface.
    Unknown,
}

impl GeomValues {
    /// MuJoCo's values where neither class nor element states any.
    pub const DEFAULT: GeomValues = GeomValues {
        shape: Shape::Sphere,
        size: [0.0; 3],
        ends: None,
        position: [0.0; 3],
        orientation: Orientation::NONE,
        mass: None,
        density: 1000.0,
        group: 0.0,
        is_shell: false,
        has_mesh: false,
    };

    /// Replaces what an element states.
    pub fn apply(&mut self, element: Element) -> Result<(), DescriptionError> {
        self.shape = match element.attribute("type") {
            None => self.shape,
            Some("sphere") => Shape::Sphere,
            Some("capsule") => Shape::Capsule,
            Some("ellipsoid") => Shape::Ellipsoid,
            Some("cylinder") => Shape::Cylinder,
            Some("box") => Shape::Box,
            Some("plane" | "hfield") => Shape::Massless,
            Some("mesh" | "sdf") => Shape::Mesh,
            Some(other) => {
                let problem = format!("{} has the unknown type `{other}`", element.title());
                return Err(element.error(problem, "use a type of MJCF, such as capsule or box"));
            }
        };
        // A class may state more sizes than the element replaces.
        for (size, stated) in self.size.iter_mut().zip(element.numbers("size", 3)?.unwrap_or_default()) {
            *size = stated;
        }
        self.ends = element.vector("fromto")?.or(self.ends);
        self.position = element.vector("pos")?.unwrap_or(self.position);
        self.orientation.apply(element)?;
        self.mass = element.number("mass")?.or(self.mass);
        self.density = element.number("density")?.unwrap_or(self.density);
        self.group = element.number("group")?.unwrap_or(self.group);
        self.is_shell = element.is_true("shellinertia")?.unwrap_or(self.is_shell);
        self.has_mesh |= element.attribute("mesh").is_some();
        if self.mass.is_some_and(|mass| mass < 0.0) || self.density < 0.0 {
            let problem = format!("{} has a negative mass or density", element.title());
            return Err(element.error(problem, "give a positive one"));
        }
        Ok(())
    }

    /// The mass of the geom, in the frame of its body, where `frame` is the placement of the elements around it.
    pub fn inertia(
        &self,
        element: Element,
        settings: &Settings,
        frame: &Placement,
    ) -> Result<GeomMass, DescriptionError> {
        let [first, last] = settings.inertia_groups;
        if !(first..=last).contains(&self.group) || self.shape == Shape::Massless || self.mass == Some(0.0) {
            return Ok(GeomMass::Nothing);
        }
        if self.shape == Shape::Mesh || self.has_mesh || self.is_shell {
            return Ok(GeomMass::Unknown);
        }
        let (size, position, rotation) = self.extent(element, settings)?;
        let volume = self.volume(size);
        let mass_kg = self.mass.unwrap_or(self.density * volume);
        if mass_kg <= 0.0 {
            return Ok(GeomMass::Nothing);
        }
        let [xx, yy, zz] = self.moments(size, mass_kg);
        let rotation = product(&frame.rotation, &rotation);
        let centre_m = add(frame.translation_m, apply(&frame.rotation, position));
        let inertia_kg_m2 = rotate_tensor(&rotation, [xx, yy, zz, 0.0, 0.0, 0.0]);
        Ok(GeomMass::Known(Inertia { mass_kg, centre_m, inertia_kg_m2 }))
    }

    /// Sizes, position and orientation, with those that follow from the two ends of `fromto`.
    fn extent(&self, element: Element, settings: &Settings) -> Result<Extent, DescriptionError> {
        let mut size = self.size;
        let (position, rotation) = match self.ends {
            None => (self.position, self.orientation.resolve(element, settings)?),
            Some([a, b, c, d, e, f]) => {
                let (from, to) = ([a, b, c], [d, e, f]);
                let along = subtract(from, to);
                let length = along[0].hypot(along[1]).hypot(along[2]);
                if !(1e-14..f64::MAX).contains(&length) || self.shape == Shape::Sphere {
                    let problem = format!(
                        "{}: fromto does not span a capsule, cylinder, ellipsoid or box",
                        element.title()
                    );
                    return Err(element.error(problem, "give two different points"));
                }
                if self.position != [0.0; 3] {
                    let problem = format!("{} has both pos and fromto", element.title());
                    return Err(element.error(problem, "remove pos"));
                }
                size[1] = length / 2.0;
                if matches!(self.shape, Shape::Ellipsoid | Shape::Box) {
                    size = [size[0], size[0], size[1]];
                }
                let middle = add(from, to).map(|component| component / 2.0);
                (middle, super::orientation::turn_z_to(along.map(|component| component / length)))
            }
        };
        let needed = match self.shape {
            Shape::Sphere => 1,
            Shape::Capsule | Shape::Cylinder => 2,
            _ => 3,
        };
        if size[..needed].iter().any(|size| *size <= 0.0) {
            let problem = format!("{} has a size of 0 or less, or one that is missing", element.title());
            return Err(element.error(problem, "give the sizes of its type"));
        }
        Ok((size, position, rotation))
    }

    /// Volume, m3.
    fn volume(&self, [a, b, c]: [f64; 3]) -> f64 {
        match self.shape {
            Shape::Sphere => 4.0 / 3.0 * PI * a.powi(3),
            Shape::Capsule => PI * (a * a * 2.0 * b + 4.0 / 3.0 * a.powi(3)),
            Shape::Cylinder => PI * a * a * 2.0 * b,
            Shape::Ellipsoid => 4.0 / 3.0 * PI * a * b * c,
            Shape::Box => 8.0 * a * b * c,
            Shape::Massless | Shape::Mesh => 0.0,
        }
    }

    /// Principal moments about the axes of the geom, kg m2, of a homogeneous body.
    fn moments(&self, [a, b, c]: [f64; 3], mass: f64) -> [f64; 3] {
        match self.shape {
            Shape::Sphere => [0.4 * mass * a * a; 3],
            Shape::Cylinder => {
                let across = mass * (3.0 * a * a + 4.0 * b * b) / 12.0;
                [across, across, mass * a * a / 2.0]
            }
            Shape::Capsule => {
                // A cylinder and two half balls, whose centres of mass are 3/8 radius outside its ends.
                let height = 2.0 * b;
                let balls = mass * 4.0 * a / (4.0 * a + 3.0 * height);
                let cylinder = mass - balls;
                let ball = 0.4 * balls * a * a;
                let across = cylinder * (3.0 * a * a + height * height) / 12.0
                    + ball
                    + balls * height * (3.0 * a + 2.0 * height) / 8.0;
                [across, across, cylinder * a * a / 2.0 + ball]
            }
            Shape::Ellipsoid => {
                [b * b + c * c, a * a + c * c, a * a + b * b].map(|square| mass * square / 5.0)
            }
            Shape::Box => [b * b + c * c, a * a + c * c, a * a + b * b].map(|square| mass * square / 3.0),
            Shape::Massless | Shape::Mesh => [0.0; 3],
        }
    }
}
