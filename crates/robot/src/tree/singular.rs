//! Refusal of joints that move no inertia, whose accelerations are undefined.

use super::{Tree, TreeError};
use crate::algebra::Numbers;
use crate::description::Robot;
use crate::forward_dynamics::{factorise, mass_matrix};

/// Pivots below this share of the mass matrix's diagonal are zero within rounding.
const SINGULAR: f64 = 1e-12;

impl Tree {
    /// Refuses a tree whose mass matrix is singular with the inertias and armatures of the file.
    ///
    /// Only forward dynamics needs this: torques of a given motion exist without it, and a fit may find the inertias. A
    /// massless body is allowed where a later body or an armature gives its joint inertia.
    ///
    /// # Errors
    /// [`TreeError::NoInertia`] for a joint that moves no positive inertia while the joints before it are held and those behind
    /// it are free.
    pub fn check_inertia(&self, robot: &Robot) -> Result<(), TreeError> {
        // At arbitrary positions, since a mass matrix may be singular at special ones only, such as where two axes of a
        // massless wrist are in line.
        let singular =
            self.singular_coordinate(robot, 0.3).and_then(|_| self.singular_coordinate(robot, 1.1));
        let Some(coordinate) = singular else {
            return Ok(());
        };
        let leads = |body: &&super::Body| {
            body.coordinate == coordinate && robot.joints[body.joint].coupling.is_none()
        };
        // Every coordinate is the position of an independent joint.
        let Some(body) = self.bodies.iter().find(leads) else {
            return Ok(());
        };
        let joint = &robot.joints[body.joint];
        Err(TreeError::NoInertia { file: robot.file.clone(), joint: joint.name.clone(), line: joint.line })
    }

    /// A coordinate whose inertia, with all later coordinates free to move, is not positive at a position.
    fn singular_coordinate(&self, robot: &Robot, first_position: f64) -> Option<usize> {
        let parameters = self.body_parameters(&mut Numbers, &self.link_parameters(robot));
        let position: Vec<f64> = (0..self.coordinates).map(|k| first_position + 0.7 * k as f64).collect();
        let mut matrix = mass_matrix(&mut Numbers, self, &parameters, &self.armature(robot), &position);
        let diagonal: Vec<f64> = (0..self.coordinates).map(|k| matrix[k][k]).collect();
        factorise(&mut Numbers, &mut matrix);
        let is_singular = |k: &usize| matrix[*k][*k].is_nan() || matrix[*k][*k] <= SINGULAR * diagonal[*k];
        // In the order of the elimination: later pivots are not numbers behind a pivot of 0.
        (0..self.coordinates).rev().find(is_singular)
    }
}
