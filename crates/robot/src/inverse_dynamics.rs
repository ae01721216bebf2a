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
use crate::joint_motion::JointMotion;
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
    let joints = joint_motions(a, tree, position);
    torques(a, tree, &joints, parameters, gravity, speed, acceleration)
}

/// Change of frame across each joint.
pub(crate) fn joint_motions<'t, A: Algebra>(
    a: &mut A,
    tree: &'t Tree,
    position: &[A::Value],
) -> Vec<JointMotion<'t, A::Value>> {
    tree.bodies.iter().map(|body| JointMotion::new(a, body, position)).collect()
}

/// The torques of [`inverse_dynamics`], from the changes of frame.
pub(crate) fn torques<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    joints: &[JointMotion<'_, A::Value>],
    parameters: &[[A::Value; 10]],
    gravity: [A::Value; 3],
    speed: &[A::Value],
    acceleration: &[A::Value],
) -> Vec<A::Value> {
    let motions = body_motions(a, tree, joints, gravity, speed, acceleration);
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
    /// W: a point p of the body accelerates by W p more than the origin.
    pub gradient: [[V; 3]; 3],
    /// Products xy, xz and yz of the angular velocity.
    pub products: [V; 3],
}

impl<V: Copy> BodyMotion<V> {
    /// The motion with W = [alpha]x + [omega]x [omega]x.
    #[inline(always)]
    fn new<A: Algebra<Value = V>>(a: &mut A, omega: [V; 3], alpha: [V; 3], acceleration: [V; 3]) -> Self {
        let [x, y, z] = omega;
        let [xx, yy, zz] = [a.multiply(x, x), a.multiply(y, y), a.multiply(z, z)];
        let [xy, xz, yz] = [a.multiply(x, y), a.multiply(x, z), a.multiply(y, z)];
        let sums = [a.add(yy, zz), a.add(xx, zz), a.add(xx, yy)];
        let [wxx, wyy, wzz] = a.negate3(sums);
        let gradient = [
            [wxx, a.subtract(xy, alpha[2]), a.add(xz, alpha[1])],
            [a.add(xy, alpha[2]), wyy, a.subtract(yz, alpha[0])],
            [a.subtract(xz, alpha[1]), a.add(yz, alpha[0]), wzz],
        ];
        BodyMotion { omega, alpha, acceleration, gradient, products: [xy, xz, yz] }
    }
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
    let base =
        BodyMotion { omega: zero, alpha: zero, acceleration: upwards, gradient: [zero; 3], products: zero };
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
        return BodyMotion::new(a, omega, alpha, acceleration);
    };
    let motion = BodyMotion::new(a, carried, alpha, acceleration);
    let along = a.apply_to_constant(&motion.gradient, body.axis);
    let along = a.scale3(distance, along);
    acceleration = a.add3(acceleration, along);
    // Coriolis acceleration: 2 omega x axis times the speed along the axis.
    let doubled = a.add(rate, rate);
    let coriolis = a.scale3(doubled, sideways);
    acceleration = a.add3(acceleration, coriolis);
    acceleration = a.add_along(acceleration, body.axis, change);
    BodyMotion { acceleration, ..motion }
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
    let turning = turning_moment(a, motion, &tensor);
    let lever = a.cross(moment, motion.acceleration);
    [a.add3(turning, lever), force]
}

/// Moment I alpha + omega x I omega, written with W so that it takes fewer products.
#[inline(always)]
fn turning_moment<A: Algebra>(
    a: &mut A,
    motion: &BodyMotion<A::Value>,
    &[ixx, ixy, ixz, iyy, iyz, izz]: &[A::Value; 6],
) -> [A::Value; 3] {
    let BodyMotion { alpha, gradient: [wx, wy, wz], products: [xy, xz, yz], .. } = *motion;
    let [about_x, about_y, about_z] =
        [a.subtract(wy[1], wz[2]), a.subtract(wz[2], wx[0]), a.subtract(wx[0], wy[1])];
    let [excess_x, excess_y, excess_z] = [a.subtract(izz, iyy), a.subtract(ixx, izz), a.subtract(iyy, ixx)];
    let mut component = |pairs: [[A::Value; 2]; 4], [i, w]: [A::Value; 2]| {
        let first = a.sum_of_products(pairs[0], pairs[1]);
        let second = a.sum_of_products(pairs[2], pairs[3]);
        let sum = a.add(first, second);
        let last = a.multiply(i, w);
        a.subtract(sum, last)
    };
    [
        component([[ixx, alpha[0]], [excess_x, yz], [ixz, wy[0]], [iyz, about_x]], [ixy, wz[0]]),
        component([[iyy, alpha[1]], [excess_y, xz], [ixy, wz[1]], [ixz, about_y]], [iyz, wx[1]]),
        component([[izz, alpha[2]], [excess_z, xy], [iyz, wx[2]], [ixy, about_z]], [ixz, wy[2]]),
    ]
}
