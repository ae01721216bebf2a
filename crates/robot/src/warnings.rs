//! Statements of a description file that are allowed and probably wrong.

use augsim_linear::{Mat, symmetric_eigen};

use crate::description::{Format, Inertia, Robot};
use crate::rotation::tensor;
use crate::structure::{is_moving, joints_above, moving_links, parent_joints};

/// By how much the largest principal moment may exceed the sum of the others, relative to it: digits of rounded files.
const TRIANGLE_TOLERANCE: f64 = 1e-9;

impl Robot {
    /// Statements of the file that are allowed and probably wrong, one sentence each, with file and line.
    ///
    /// - An inertia tensor that no distribution of mass has: a principal moment that is negative, or larger than the sum
    ///   of the two others.
    /// - A moving link of a URDF file without mass, which is rigidly attached to a link with mass.
    /// - Negative friction, armature or stiffness of a joint.
    pub fn warnings(&self) -> Vec<String> {
        let moving = moving_links(self);
        let attached = attached_to_mass(self);
        let mut warnings = Vec::new();
        for (k, link) in self.links.iter().enumerate() {
            let place = format!("{}, line {}: link `{}`", self.file, link.line, link.name);
            match &link.inertia {
                Some(inertia) => {
                    if let Some(wrong) = impossible_tensor(inertia) {
                        warnings.push(format!("{place} has an inertia tensor that no body has: {wrong}"));
                    }
                }
                None if moving[k] && self.format == Format::Urdf && attached[k] => {
                    warnings.push(format!("{place} moves and has no <inertial>; it counts as massless"));
                }
                None => {}
            }
        }
        for joint in &self.joints {
            let values = [
                ("damping", joint.damping),
                ("friction", joint.friction_loss),
                ("armature", joint.armature),
                ("stiffness", joint.stiffness),
            ];
            for (name, _) in values.iter().filter(|(_, value)| *value < 0.0) {
                let place = format!("{}, line {}: joint `{}`", self.file, joint.line, joint.name);
                warnings.push(format!("{place} has a negative {name}"));
            }
        }
        warnings
    }
}

/// Whether each link, or one that fixed joints attach to it, has mass.
fn attached_to_mass(robot: &Robot) -> Vec<bool> {
    let parents = parent_joints(robot);
    // The links that fixed joints connect have one of them in common: the one nearest to the base.
    let nearest = |link: usize| {
        let above = joints_above(robot, &parents, link);
        let fixed = above.into_iter().take_while(|joint| !is_moving(robot, *joint));
        fixed.last().map_or(link, |joint| robot.joints[joint].parent)
    };
    let nearest: Vec<usize> = (0..robot.links.len()).map(nearest).collect();
    let mut has_mass = vec![false; robot.links.len()];
    for (link, nearest) in robot.links.iter().zip(&nearest) {
        has_mass[*nearest] |= link.inertia.is_some_and(|inertia| inertia.mass_kg > 0.0);
    }
    nearest.into_iter().map(|nearest| has_mass[nearest]).collect()
}

/// Principal moments of an inertia tensor, ascending, kg m2; `None` if they are not finite.
pub(crate) fn principal_moments(inertia: &[f64; 6]) -> Option<[f64; 3]> {
    let matrix = tensor(*inertia);
    let eigen = symmetric_eigen(&Mat::from_fn(3, 3, |i, j| matrix[i][j]))?;
    <[f64; 3]>::try_from(eigen.values.as_slice()).ok()
}

/// Why no distribution of mass has this tensor; `None` if one does.
fn impossible_tensor(inertia: &Inertia) -> Option<String> {
    let [a, b, c] = principal_moments(&inertia.inertia_kg_m2)?;
    let tolerance = TRIANGLE_TOLERANCE * c.abs();
    if a < -tolerance {
        Some(format!("its smallest principal moment is {a:.4e} kg m2"))
    } else if c > a + b + tolerance {
        Some(format!(
            "its largest principal moment, {c:.4e} kg m2, exceeds the sum of the others, {:.4e}",
            a + b
        ))
    } else {
        None
    }
}
