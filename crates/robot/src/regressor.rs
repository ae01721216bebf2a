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
use crate::inverse_dynamics::{BodyMotion, body_motions, joint_motions};
use crate::tree::{Body, Tree};
use crate::vectors::Vectors;

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
    let joints = joint_motions(a, tree, position);
    let motions = body_motions(a, tree, &joints, gravity, speed, acceleration);
    let zero = a.constant(0.0);
    let mut matrix = vec![vec![zero; 10 * tree.bodies.len()]; tree.coordinates];
    // By body, for each joint that moves it.
    let mut unit_motions: Vec<Vec<UnitMotion<A::Value>>> = Vec::with_capacity(tree.bodies.len());
    for (index, body) in tree.bodies.iter().enumerate() {
        let parents = body.parent.map_or(&[][..], |parent| &unit_motions[parent]);
        let mut moving: Vec<_> =
            parents.iter().map(|&(joint, motion)| (joint, joints[index].carried(a, motion))).collect();
        let [x, y, z] = body.axis;
        let (axis, still) = ([a.constant(x), a.constant(y), a.constant(z)], a.zero3());
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
    #[inline(always)]
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
#[inline(always)]
fn unit_wrenches<A: Algebra>(a: &mut A, motion: &BodyMotion<A::Value>) -> [Wrench<A::Value>; 10] {
    let BodyMotion { alpha, acceleration, gradient: [wx, wy, wz], products: [xy, xz, yz], .. } = *motion;
    let [along_x, along_y, along_z] = [
        a.cross_constant([1.0, 0.0, 0.0], acceleration),
        a.cross_constant([0.0, 1.0, 0.0], acceleration),
        a.cross_constant([0.0, 0.0, 1.0], acceleration),
    ];
    // E alpha + omega x E omega, written out with the elements of W.
    let [minus_xy, minus_xz, minus_yz] = a.negate3([xy, xz, yz]);
    let [minus_wxy, minus_wyz, minus_wzx] = a.negate3([wx[1], wy[2], wz[0]]);
    let [about_x, about_y, about_z] =
        [a.subtract(wy[1], wz[2]), a.subtract(wz[2], wx[0]), a.subtract(wx[0], wy[1])];
    [
        Wrench::Force(acceleration),
        Wrench::Both(along_x, [wx[0], wy[0], wz[0]]),
        Wrench::Both(along_y, [wx[1], wy[1], wz[1]]),
        Wrench::Both(along_z, [wx[2], wy[2], wz[2]]),
        Wrench::Moment([alpha[0], xz, minus_xy]),
        Wrench::Moment([minus_wzx, wz[1], about_z]),
        Wrench::Moment([wy[0], about_y, minus_wyz]),
        Wrench::Moment([minus_yz, alpha[1], xy]),
        Wrench::Moment([about_x, minus_wxy, wx[2]]),
        Wrench::Moment([yz, minus_xz, alpha[2]]),
    ]
}
