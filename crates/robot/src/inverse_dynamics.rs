//! Joint torques from positions, speeds and accelerations: the recursive Newton-Euler algorithm.
//!
//! For each body, in its own frame, with angular velocity omega, angular acceleration alpha, acceleration a of the origin
//! (less gravity), mass m, moment h = m c, inertia tensor I about the origin and W = [alpha]x + [omega]x [omega]x:
//!
//! 1. force f = m a + W h,
//! 2. moment about the origin n = I alpha + omega x I omega + h x a,
//! 3. torque = axis . n (revolute) or axis . f (prismatic) of the sum over the body and all bodies behind it.
//!
//! These are the equations of Featherstone, *Rigid Body Dynamics Algorithms*, 2008, Table 5.1, for the acceleration of the
//! origin in place of the spatial acceleration (Luh, Walker and Paul 1980): they need no velocity of the origin, which makes
//! them shorter.

use crate::algebra::Algebra;
use crate::inertia::split;
use crate::joint_motion::{JointMotion, gradient};
use crate::tree::{Body, Tree};
use crate::vectors::Vectors;

/// Torques or forces of the coordinates (N m or N) that a motion needs, without friction and armature.
///
/// `parameters` are the ten of each body ([`Tree::body_parameters`]), `gravity` is the acceleration of gravity in the frame of
/// the base (m/s2); `position`, `speed` and `acceleration` are by coordinate. The torque of a coordinate is the sum over the
/// joints that it moves, each times its ratio.
pub fn inverse_dynamics<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    parameters: &[[A::Value; 10]],
    gravity: [A::Value; 3],
    position: &[A::Value],
    speed: &[A::Value],
    acceleration: &[A::Value],
) -> Vec<A::Value> {
    let joints: Vec<_> = tree.bodies.iter().map(|body| JointMotion::new(a, body, position)).collect();
    let motions = body_motions(a, tree, &joints, gravity, speed, acceleration);
    let mut wrenches: Vec<_> =
        motions.iter().zip(parameters).map(|(motion, parameters)| wrench(a, motion, parameters)).collect();
    let mut torque = vec![None; tree.coordinates];
    for (index, body) in tree.bodies.iter().enumerate().rev() {
        let [moment, force] = wrenches[index];
        let share = a.dot_constant(body.axis, if body.is_prismatic { force } else { moment });
        let share = a.combine([(body.ratio, share)]);
        let sum = &mut torque[body.coordinate];
        *sum = Some(sum.map_or(share, |sum| a.add(sum, share)));
        if let Some(parent) = body.parent {
            let [moment, force] = joints[index].wrench_into_parent(a, [moment, force]);
            let [parent_moment, parent_force] = wrenches[parent];
            wrenches[parent] = [a.add3(parent_moment, moment), a.add3(parent_force, force)];
        }
    }
    torque.into_iter().map(|sum| sum.unwrap_or_else(|| a.constant(0.0))).collect()
}

/// Motion of a body's frame, in the frame.
#[derive(Clone, Copy)]
pub(crate) struct BodyMotion<V> {
    /// Angular velocity, rad/s.
    pub omega: [V; 3],
    /// Angular acceleration, rad/s2.
    pub alpha: [V; 3],
    /// Acceleration of the origin less gravity, m/s2.
    pub acceleration: [V; 3],
    /// Difference of acceleration between a point and the origin, per position of the point; see [`gradient`].
    pub gradient: [[V; 3]; 3],
}

/// Motion of each body, from the base to the tips.
pub(crate) fn body_motions<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    joints: &[JointMotion<'_, A::Value>],
    gravity: [A::Value; 3],
    speed: &[A::Value],
    acceleration: &[A::Value],
) -> Vec<BodyMotion<A::Value>> {
    // A base at rest in gravity is equivalent to one that accelerates upwards without gravity.
    let zero = a.zero3();
    let upwards = a.negate3(gravity);
    let base = BodyMotion { omega: zero, alpha: zero, acceleration: upwards, gradient: [zero; 3] };
    let mut motions: Vec<BodyMotion<A::Value>> = Vec::with_capacity(tree.bodies.len());
    for (body, joint) in tree.bodies.iter().zip(joints) {
        let parent = body.parent.map_or(base, |parent| motions[parent]);
        let rate = a.combine([(body.ratio, speed[body.coordinate])]);
        let change = a.combine([(body.ratio, acceleration[body.coordinate])]);
        motions.push(next_motion(a, body, joint, &parent, [rate, change]));
    }
    motions
}

/// Motion of a body from that of its parent and the speed and acceleration of its joint.
#[inline(always)]
fn next_motion<A: Algebra>(
    a: &mut A,
    body: &Body,
    joint: &JointMotion<'_, A::Value>,
    parent: &BodyMotion<A::Value>,
    [rate, change]: [A::Value; 2],
) -> BodyMotion<A::Value> {
    let carried = joint.direction_in_body(a, parent.omega);
    let mut alpha = joint.direction_in_body(a, parent.alpha);
    let mut acceleration = joint.acceleration_of_origin(a, parent.acceleration, &parent.gradient);
    // omega x axis, where the axis turns with the parent.
    let sideways = a.cross_constant(body.axis.map(|x| -x), carried);
    let Some(distance) = joint.distance() else {
        let gyroscopic = a.scale3(rate, sideways);
        alpha = a.add3(alpha, gyroscopic);
        alpha = a.add_along(alpha, body.axis, change);
        let omega = a.add_along(carried, body.axis, rate);
        let gradient = gradient(a, omega, alpha);
        return BodyMotion { omega, alpha, acceleration, gradient };
    };
    let gradient = gradient(a, carried, alpha);
    let along = a.apply_to_constant(&gradient, body.axis);
    let along = a.scale3(distance, along);
    acceleration = a.add3(acceleration, along);
    // Coriolis acceleration: 2 omega x axis times the speed along the axis.
    let doubled = a.add(rate, rate);
    let coriolis = a.scale3(doubled, sideways);
    acceleration = a.add3(acceleration, coriolis);
    acceleration = a.add_along(acceleration, body.axis, change);
    BodyMotion { omega: carried, alpha, acceleration, gradient }
}

/// Moment about the origin and force that the motion of one body needs: equations 1 and 2.
#[inline(always)]
fn wrench<A: Algebra>(
    a: &mut A,
    motion: &BodyMotion<A::Value>,
    parameters: &[A::Value; 10],
) -> [[A::Value; 3]; 2] {
    let (mass, moment, tensor) = split(parameters);
    let force = a.scale3(mass, motion.acceleration);
    let difference = a.apply(&motion.gradient, moment);
    let force = a.add3(force, difference);
    let turning = a.apply_symmetric(&tensor, motion.alpha);
    let spin = a.apply_symmetric(&tensor, motion.omega);
    let gyroscopic = a.cross(motion.omega, spin);
    let lever = a.cross(moment, motion.acceleration);
    let turning = a.add3(turning, gyroscopic);
    [a.add3(turning, lever), force]
}
