//! Orientations of an MJCF file: a quaternion, an axis with an angle, two axes, the z axis, or Euler angles.

use super::settings::Settings;
use crate::description::Placement;
use crate::error::DescriptionError;
use crate::rotation::{
    IDENTITY, Matrix, about_axis, cross, dot, from_quaternion, normalize, subtract, transpose,
};
use crate::xml::Element;

/// Attributes that state an orientation.
const SPECIFIERS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// Orientation other than by a quaternion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Alternative {
    AxisAngle([f64; 4]),
    XyAxes([f64; 6]),
    ZAxis([f64; 3]),
    Euler([f64; 3]),
}

/// An orientation as the file states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Orientation {
    quaternion: [f64; 4],
    /// Takes the place of the quaternion, even where a class states it and the element a quaternion.
    alternative: Option<Alternative>,
}

impl Orientation {
    /// The orientation of the parent frame.
    pub const NONE: Orientation = Orientation { quaternion: [1.0, 0.0, 0.0, 0.0], alternative: None };

    /// Whether an element states an orientation.
    pub fn is_stated(element: Element) -> bool {
        SPECIFIERS.iter().any(|name| element.attribute(name).is_some())
    }

    /// Replaces what an element states.
    pub fn apply(&mut self, element: Element) -> Result<(), DescriptionError> {
        if SPECIFIERS.iter().filter(|name| element.attribute(name).is_some()).count() > 1 {
            let problem = format!("{} has several orientations", element.title());
            return Err(element.error(problem, "keep one of quat, axisangle, xyaxes, zaxis and euler"));
        }
        self.quaternion = element.vector("quat")?.unwrap_or(self.quaternion);
        let alternatives = [
            element.vector("axisangle")?.map(Alternative::AxisAngle),
            element.vector("xyaxes")?.map(Alternative::XyAxes),
            element.vector("zaxis")?.map(Alternative::ZAxis),
            element.vector("euler")?.map(Alternative::Euler),
        ];
        self.alternative = alternatives.into_iter().flatten().next().or(self.alternative);
        Ok(())
    }

    /// The rotation matrix.
    pub fn resolve(&self, element: Element, settings: &Settings) -> Result<Matrix, DescriptionError> {
        let rotation = match self.alternative {
            None => normalize(self.quaternion).map(from_quaternion),
            Some(Alternative::AxisAngle([x, y, z, angle])) => {
                normalize([x, y, z]).map(|axis| about_axis(axis, settings.radians(angle)))
            }
            Some(Alternative::XyAxes([a, b, c, d, e, f])) => from_axes([a, b, c], [d, e, f]),
            Some(Alternative::ZAxis(axis)) => normalize(axis).map(turn_z_to),
            Some(Alternative::Euler(angles)) => Some(settings.euler_rotation(angles)),
        };
        rotation.ok_or_else(|| {
            let problem =
                format!("{}: its orientation has an axis or a quaternion of length 0", element.title());
            element.error(problem, "give a direction")
        })
    }
}

/// Placement of an element that states `pos` and an orientation, in its parent.
pub(super) fn read_placement(element: Element, settings: &Settings) -> Result<Placement, DescriptionError> {
    let mut orientation = Orientation::NONE;
    orientation.apply(element)?;
    Ok(Placement {
        rotation: orientation.resolve(element, settings)?,
        translation_m: element.vector("pos")?.unwrap_or([0.0; 3]),
    })
}

/// The rotation whose first column is along `x` and whose second is in the plane of `x` and `y`.
fn from_axes(x: [f64; 3], y: [f64; 3]) -> Option<Matrix> {
    let x = normalize(x)?;
    let along = dot(x, y);
    let y = normalize(subtract(y, x.map(|component| along * component)))?;
    Some(transpose(&[x, y, cross(x, y)]))
}

/// The shortest rotation that turns the z axis to a direction of length 1.
pub(super) fn turn_z_to(direction: [f64; 3]) -> Matrix {
    let axis = cross([0.0, 0.0, 1.0], direction);
    let sine = dot(axis, axis).sqrt();
    // Opposite to z, any axis in the xy plane will do: MuJoCo turns about x.
    let axis = if sine < 1e-10 { IDENTITY[0] } else { axis.map(|component| component / sine) };
    about_axis(axis, sine.atan2(direction[2]))
}
