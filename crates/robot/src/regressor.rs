//! Derivatives of the torques with respect to the inertial parameters, in which they are linear.
//!
//! In the frame of a body (quantities as in `inverse_dynamics.rs`), the wrench of each unit parameter is
//!
//! - mass: force a,
//! - moment h_k: force W e_k, moment e_k x a,
//! - tensor element I_ij: moment E alpha + omega x E omega, where E is the symmetric unit tensor of the element.
//!
//! Its share of the torque of a joint is its product with the motion of the body that a unit speed of the joint gives.
//! Reference: Atkeson, An and Hollerbach, *Estimation of inertial parameters of manipulator loads and links*, 1986.

use crate::algebra::Algebra;
use crate::inverse_dynamics::{BodyMotion, body_motions};
use crate::joint_motion::JointMotion;
use crate::tree::{Body, Tree};
use crate::vectors::{SYMMETRIC, Vectors};

/// Derivatives of the torques of the inverse dynamics with respect to the parameters: `[coordinate][10 * body + k]`.
///
/// The torques of [`crate::inverse_dynamics`] are this matrix times the ten parameters of each body, one body after the
/// other. Gravity and motion are those of [`crate::inverse_dynamics`]. Bodies that a coordinate does not move have zeros.
pub fn regressor<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    gravity: [A::Value; 3],
    position: &[A::Value],
    speed: &[A::Value],
    acceleration: &[A::Value],
) -> Vec<Vec<A::Value>> {
    let joints: Vec<_> = tree.bodies.iter().map(|body| JointMotion::new(a, body, position)).collect();
    let motions = body_motions(a, tree, &joints, gravity, speed, acceleration);
    let zero = a.constant(0.0);
    let mut matrix = vec![vec![zero; 10 * tree.bodies.len()]; tree.coordinates];
    // By body, for each joint that moves it.
    let mut unit_motions: Vec<Vec<UnitMotion<A::Value>>> = Vec::with_capacity(tree.bodies.len());
    for (index, body) in tree.bodies.iter().enumerate() {
        let parents = body.parent.map_or(&[][..], |parent| &unit_motions[parent]);
        let mut moving: Vec<_> =
            parents.iter().map(|&(joint, motion)| (joint, joints[index].carried(a, motion))).collect();
        let (axis, still) = (body.axis.map(|x| a.constant(x)), a.zero3());
        moving.push((index, if body.is_prismatic { [still, axis] } else { [axis, still] }));
        let wrenches = unit_wrenches(a, &motions[index]);
        for &(joint, motion) in &moving {
            let Body { coordinate, ratio, .. } = tree.bodies[joint];
            let row = &mut matrix[coordinate][10 * index..][..10];
            for (value, wrench) in row.iter_mut().zip(&wrenches) {
                let share = wrench.times(a, motion);
                let share = a.combine([(ratio, share)]);
                *value = a.add(*value, share);
            }
        }
        unit_motions.push(moving);
    }
    matrix
}

/// Velocity (angular, of the origin) of a body at unit speed of a joint, with the index of the joint's body.
type UnitMotion<V> = (usize, [[V; 3]; 2]);

/// Moment about the origin and force on a body; a part that is 0 is left out.
enum Wrench<V> {
    /// Force through the origin.
    Force([V; 3]),
    /// Moment without force.
    Moment([V; 3]),
    /// Moment and force.
    Both([V; 3], [V; 3]),
}

impl<V: Copy> Wrench<V> {
    /// Power of the wrench in a motion (angular, of the origin).
    fn times<A: Algebra<Value = V>>(&self, a: &mut A, [turn, speed]: [[V; 3]; 2]) -> V {
        match *self {
            Wrench::Force(force) => a.dot(force, speed),
            Wrench::Moment(moment) => a.dot(moment, turn),
            Wrench::Both(moment, force) => {
                let (first, second) = (a.dot(moment, turn), a.dot(force, speed));
                a.add(first, second)
            }
        }
    }
}

/// Wrenches that the motion of a body needs, per unit of each of its ten parameters.
fn unit_wrenches<A: Algebra>(a: &mut A, motion: &BodyMotion<A::Value>) -> [Wrench<A::Value>; 10] {
    let unit = |k: usize| [0, 1, 2].map(|row| f64::from(u8::from(row == k)));
    let of_mass = Wrench::Force(motion.acceleration);
    let of_moment = [0, 1, 2].map(|k| {
        let force = motion.gradient.map(|row| row[k]);
        Wrench::Both(a.cross_constant(unit(k), motion.acceleration), force)
    });
    let of_tensor = SYMMETRIC.map(|[i, j]| {
        let symmetric = |a: &mut A, x: [A::Value; 3]| {
            let product = a.zero3();
            let product = a.add_along(product, unit(i), x[j]);
            if i == j { product } else { a.add_along(product, unit(j), x[i]) }
        };
        let (turning, spin) = (symmetric(a, motion.alpha), symmetric(a, motion.omega));
        let gyroscopic = a.cross(motion.omega, spin);
        Wrench::Moment(a.add3(turning, gyroscopic))
    });
    let ([x, y, z], [xx, xy, xz, yy, yz, zz]) = (of_moment, of_tensor);
    [of_mass, x, y, z, xx, xy, xz, yy, yz, zz]
}
