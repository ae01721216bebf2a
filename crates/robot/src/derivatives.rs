//! Exact derivatives of the joint torques with respect to positions, speeds and accelerations.
//!
//! Everything is expressed in the frame of the base. Motions are pairs (angular velocity, velocity of the point of the body at
//! the origin of the base), wrenches are pairs (moment about that origin, force). For body i with joint axis S_i, velocity v_i
//! and acceleration a_i (less gravity), and p the parent of i:
//!
//! 1. psi_i = v_p x S_i, the rate of S_i, and chi_i = a_p x S_i + v_p x psi_i,
//! 2. v_i = v_p + S_i q', a_i = a_p + S_i q'' + psi_i q',
//! 3. N = integral of r' r^T dm over the body, where r' is the velocity of the mass at r; C = 2 (tr(N) 1 - N),
//! 4. B maps a motion (s, u) to the wrench of the Coriolis force 2 s x r' dm: (C s, -2 l x s), with momentum l,
//! 5. I, B and the wrench f are summed over body i and all bodies behind it.
//!
//! Then for a body j from the base to i, and with the wrench operator f x S = (s x moment + u x force, s x force):
//!
//! - d torque_i / d q_j = S_i . (B psi_j + I chi_j)
//! - d torque_j / d q_i = S_j . (B psi_i + I chi_i + f x S_i) for j before i
//! - d torque_i / d q'_j = S_i . (B S_j + 2 I psi_j), and with i and j exchanged but B and I of i
//! - d torque_i / d q''_j = S_i . I S_j
//!
//! Reference: Singh, Russell and Wensing, *Efficient analytical derivatives of rigid-body dynamics using spatial vector
//! algebra*, 2022, which orders the recursions of Carpentier and Mansard, *Analytical derivatives of rigid body dynamics
//! algorithms*, 2018, so that each pair of joints takes a few scalar products.

use crate::algebra::Algebra;
use crate::inertia::split;
use crate::joint_motion::JointMotion;
use crate::tree::{Body, Tree};
use crate::vectors::{SYMMETRIC, Vectors, symmetric_rows, transposed};

/// Torques and their derivatives; matrices are by rows: element `row * coordinates + column`, a row for each torque.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueDerivatives<V> {
    /// Torques or forces of the coordinates, N m or N, as of [`crate::inverse_dynamics`].
    pub torque: Vec<V>,
    /// Derivatives with respect to the positions.
    pub position: Vec<V>,
    /// Derivatives with respect to the speeds.
    pub speed: Vec<V>,
    /// Derivatives with respect to the accelerations: the mass matrix, without armature.
    pub acceleration: Vec<V>,
}

/// Torques of a motion and their derivatives with respect to positions, speeds and accelerations.
///
/// The arguments are those of [`crate::inverse_dynamics`].
pub fn inverse_dynamics_derivatives<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    parameters: &[[A::Value; 10]],
    gravity: [A::Value; 3],
    position: &[A::Value],
    speed: &[A::Value],
    acceleration: &[A::Value],
) -> TorqueDerivatives<A::Value> {
    let mut bodies: Vec<State<A::Value>> = Vec::with_capacity(tree.bodies.len());
    let base = base(a, gravity);
    for (body, parameters) in tree.bodies.iter().zip(parameters) {
        let parent = body.parent.map_or(&base, |parent| &bodies[parent]);
        let joint = JointMotion::new(a, body, position);
        let frame = frame(a, body, &joint, &parent.frame);
        let rate = a.combine([(body.ratio, speed[body.coordinate])]);
        let change = a.combine([(body.ratio, acceleration[body.coordinate])]);
        let motion = motion(a, body, &frame, &parent.motion, [rate, change]);
        let matter = matter(a, parameters, &frame, &motion);
        bodies.push(State { frame, motion, matter });
    }
    let (n, zero) = (tree.coordinates, a.constant(0.0));
    let square = vec![zero; n * n];
    let mut result = TorqueDerivatives {
        torque: vec![zero; n],
        position: square.clone(),
        speed: square.clone(),
        acceleration: square,
    };
    for (index, body) in tree.bodies.iter().enumerate().rev() {
        add_joint(a, tree, &bodies, index, &mut result);
        if let Some(parent) = body.parent {
            let (before, behind) = bodies.split_at_mut(index);
            before[parent].matter.add(a, &behind[0].matter);
        }
    }
    result
}

/// A motion or a wrench: angular and linear part.
type Pair<V> = [[V; 3]; 2];

/// What the recursion holds of one body.
struct State<V> {
    frame: Frame<V>,
    motion: Motion<V>,
    matter: Matter<V>,
}

/// Rotation matrix by rows, and origin of a body in the frame of the base.
struct Frame<V> {
    rotation: [[V; 3]; 3],
    origin: [V; 3],
}

/// Joint axis and motion of a body; equations 1 and 2.
struct Motion<V> {
    /// S
    axis: Pair<V>,
    /// psi
    axis_rate: Pair<V>,
    /// chi
    axis_change: Pair<V>,
    /// v
    velocity: Pair<V>,
    /// a
    acceleration: Pair<V>,
}

/// Inertia, Coriolis operator and wrench of a body, to which those of the bodies behind it are added.
struct Matter<V> {
    mass: V,
    /// Mass times centre.
    moment: [V; 3],
    /// Integral of r r^T dm.
    second_moment: [V; 6],
    /// tr(N) 1 - N, by rows; half of C.
    coriolis: [[V; 3]; 3],
    /// l
    momentum: [V; 3],
    /// f
    wrench: Pair<V>,
}

/// The base, which accelerates upwards in place of gravity.
fn base<A: Algebra>(a: &mut A, gravity: [A::Value; 3]) -> State<A::Value> {
    let (zero, one) = (a.constant(0.0), a.constant(1.0));
    let (none, still) = ([zero; 3], [[zero; 3]; 2]);
    let upwards = a.negate3(gravity);
    let rotation = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let acceleration = [none, upwards];
    State {
        frame: Frame { rotation, origin: none },
        motion: Motion { axis: still, axis_rate: still, axis_change: still, velocity: still, acceleration },
        matter: Matter {
            mass: zero,
            moment: none,
            second_moment: [zero; 6],
            coriolis: [none; 3],
            momentum: none,
            wrench: still,
        },
    }
}

/// Frame of a body from that of its parent.
#[inline(always)]
fn frame<A: Algebra>(
    a: &mut A,
    body: &Body,
    joint: &JointMotion<'_, A::Value>,
    parent: &Frame<A::Value>,
) -> Frame<A::Value> {
    // Each row of the rotation is an axis of the base, seen from the body.
    let [x, y, z] = parent.rotation;
    let rotation =
        [joint.direction_in_body(a, x), joint.direction_in_body(a, y), joint.direction_in_body(a, z)];
    let arm = a.apply_to_constant(&parent.rotation, body.placement.translation_m);
    let mut origin = a.add3(parent.origin, arm);
    if let Some(distance) = joint.distance() {
        let axis = a.apply_to_constant(&rotation, body.axis);
        let along = a.scale3(distance, axis);
        origin = a.add3(origin, along);
    }
    Frame { rotation, origin }
}

/// Joint axis and motion of a body from the motion of its parent; equations 1 and 2.
#[inline(always)]
fn motion<A: Algebra>(
    a: &mut A,
    body: &Body,
    frame: &Frame<A::Value>,
    parent: &Motion<A::Value>,
    [rate, change]: [A::Value; 2],
) -> Motion<A::Value> {
    let direction = a.apply_to_constant(&frame.rotation, body.axis);
    let axis = if body.is_prismatic {
        [a.zero3(), direction]
    } else {
        [direction, a.cross(frame.origin, direction)]
    };
    let axis_rate = cross_motions(a, &parent.velocity, &axis, body.is_prismatic);
    let carried = cross_motions(a, &parent.acceleration, &axis, body.is_prismatic);
    let turned = cross_motions(a, &parent.velocity, &axis_rate, body.is_prismatic);
    let axis_change = [a.add3(carried[0], turned[0]), a.add3(carried[1], turned[1])];
    let (mut velocity, mut acceleration) = (parent.velocity, parent.acceleration);
    // The axis of a prismatic joint has no angular part.
    for part in usize::from(body.is_prismatic)..2 {
        let added = a.scale3(rate, axis[part]);
        velocity[part] = a.add3(velocity[part], added);
        let added = a.scale3(change, axis[part]);
        acceleration[part] = a.add3(acceleration[part], added);
        let added = a.scale3(rate, axis_rate[part]);
        acceleration[part] = a.add3(acceleration[part], added);
    }
    Motion { axis, axis_rate, axis_change, velocity, acceleration }
}

/// Cross product of two motions; the second one has no angular part if `is_linear`.
#[inline(always)]
fn cross_motions<A: Algebra>(
    a: &mut A,
    x: &Pair<A::Value>,
    y: &Pair<A::Value>,
    is_linear: bool,
) -> Pair<A::Value> {
    let linear = a.cross(x[0], y[1]);
    if is_linear {
        return [y[0], linear];
    }
    let angular = a.cross(x[0], y[0]);
    let lever = a.cross(x[1], y[0]);
    [angular, a.add3(linear, lever)]
}

/// Inertia, Coriolis operator and wrench of one body in the frame of the base; equations 3 and 4.
#[inline(always)]
fn matter<A: Algebra>(
    a: &mut A,
    parameters: &[A::Value; 10],
    frame: &Frame<A::Value>,
    motion: &Motion<A::Value>,
) -> Matter<A::Value> {
    let (mass, moment, tensor) = split(parameters);
    // The integral of r r^T dm is half the trace of the inertia tensor less the tensor.
    let [xx, xy, xz, yy, yz, zz] = tensor;
    let half_trace = a.combine([(0.5, xx), (0.5, yy), (0.5, zz)]);
    let diagonal = a.subtract3([half_trace; 3], [xx, yy, zz]);
    let products = a.negate3([xy, xz, yz]);
    let local = [diagonal[0], products[0], products[1], diagonal[1], products[2], diagonal[2]];
    let [x, y, z] = frame.rotation;
    let rows = [a.apply_symmetric(&local, x), a.apply_symmetric(&local, y), a.apply_symmetric(&local, z)];
    let turned = a.apply(&frame.rotation, moment);
    let shift = a.scale3(mass, frame.origin);
    let moment = a.add3(turned, shift);
    // With moment h = turned + m p: p turned^T + turned p^T + m p p^T = p h^T + turned p^T.
    let mut second_moment = tensor;
    for (value, [i, j]) in second_moment.iter_mut().zip(SYMMETRIC) {
        let centred = a.dot(rows[i], frame.rotation[j]);
        let shift = a.sum_of_products([frame.origin[i], moment[j]], [turned[i], frame.origin[j]]);
        *value = a.add(centred, shift);
    }
    let [omega, velocity] = motion.velocity;
    let (coriolis, momentum) = coriolis(a, (mass, moment, &second_moment), omega, velocity);
    let mut matter = Matter { mass, moment, second_moment, coriolis, momentum, wrench: [moment, moment] };
    let [turning, force] = matter.times_inertia(a, &motion.acceleration);
    let gyroscopic = a.apply(&coriolis, omega);
    let centripetal = a.cross(omega, momentum);
    matter.wrench = [a.add3(turning, gyroscopic), a.add3(force, centripetal)];
    matter
}

/// Half the operator C, and the momentum, from mass, moment and second moment of a body and its motion; equation 3.
#[inline(always)]
fn coriolis<A: Algebra>(
    a: &mut A,
    (mass, moment, second_moment): (A::Value, [A::Value; 3], &[A::Value; 6]),
    omega: [A::Value; 3],
    velocity: [A::Value; 3],
) -> ([[A::Value; 3]; 3], [A::Value; 3]) {
    // r' = velocity + omega x r, hence N = velocity h^T + [omega]x (second moment); the trace of the last product is 0.
    let [x, y, z] = symmetric_rows(second_moment);
    let [x, y, z] = transposed(&[a.cross(omega, x), a.cross(omega, y), a.cross(omega, z)]);
    let products =
        [a.scale3(velocity[0], moment), a.scale3(velocity[1], moment), a.scale3(velocity[2], moment)];
    let [nx, ny, nz] = [a.add3(x, products[0]), a.add3(y, products[1]), a.add3(z, products[2])];
    let [xx, yy, zz] = [products[0][0], products[1][1], products[2][2]];
    let trace = a.add(xx, yy);
    let trace = a.add(trace, zz);
    let mut operator = [a.negate3(nx), a.negate3(ny), a.negate3(nz)];
    for (k, row) in operator.iter_mut().enumerate() {
        row[k] = a.add(row[k], trace);
    }
    let lever = a.cross(omega, moment);
    let shift = a.scale3(mass, velocity);
    (operator, a.add3(shift, lever))
}

impl<V: Copy> Matter<V> {
    /// Adds what is behind the body.
    #[inline(always)]
    fn add<A: Algebra<Value = V>>(&mut self, a: &mut A, behind: &Matter<V>) {
        self.mass = a.add(self.mass, behind.mass);
        self.moment = a.add3(self.moment, behind.moment);
        for (value, &added) in self.second_moment.iter_mut().zip(&behind.second_moment) {
            *value = a.add(*value, added);
        }
        for (row, &added) in self.coriolis.iter_mut().zip(&behind.coriolis) {
            *row = a.add3(*row, added);
        }
        self.momentum = a.add3(self.momentum, behind.momentum);
        for (part, &added) in self.wrench.iter_mut().zip(&behind.wrench) {
            *part = a.add3(*part, added);
        }
    }

    /// The product I x with a motion.
    #[inline(always)]
    fn times_inertia<A: Algebra<Value = V>>(&self, a: &mut A, [turn, speed]: &Pair<V>) -> Pair<V> {
        let second = &self.second_moment;
        let trace = a.add(second[0], second[3]);
        let trace = a.add(trace, second[5]);
        let along = a.scale3(trace, *turn);
        let across = a.apply_symmetric(second, *turn);
        let lever = a.cross(self.moment, *speed);
        let force = a.scale3(self.mass, *speed);
        let swing = a.cross(*turn, self.moment);
        let turning = a.subtract3(along, across);
        [a.add3(turning, lever), a.add3(force, swing)]
    }

    /// Half the product B x with a motion of this angular velocity.
    #[inline(always)]
    fn times_half_coriolis<A: Algebra<Value = V>>(&self, a: &mut A, turn: [V; 3]) -> Pair<V> {
        [a.apply(&self.coriolis, turn), a.cross(turn, self.momentum)]
    }

    /// Half the product B^T x with a motion; its linear part is 0.
    #[inline(always)]
    fn half_coriolis_transposed<A: Algebra<Value = V>>(&self, a: &mut A, [turn, speed]: &Pair<V>) -> [V; 3] {
        let angular = a.apply(&transposed(&self.coriolis), *turn);
        let lever = a.cross(self.momentum, *speed);
        a.add3(angular, lever)
    }
}

/// The sum `2 x + y`.
#[inline(always)]
fn twice_plus<A: Algebra>(a: &mut A, x: [A::Value; 3], y: [A::Value; 3]) -> [A::Value; 3] {
    let doubled = a.add3(x, x);
    a.add3(doubled, y)
}

/// The scalar product of a motion and a wrench.
#[inline(always)]
fn power<A: Algebra>(a: &mut A, x: &Pair<A::Value>, y: &Pair<A::Value>) -> A::Value {
    let (angular, linear) = (a.dot(x[0], y[0]), a.dot(x[1], y[1]));
    a.add(angular, linear)
}

/// Adds the torque of a joint and all derivatives that pair it with itself and with joints towards the base.
#[inline(always)]
fn add_joint<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    bodies: &[State<A::Value>],
    index: usize,
    result: &mut TorqueDerivatives<A::Value>,
) {
    let State { motion: own, matter, .. } = &bodies[index];
    let body = &tree.bodies[index];
    let torque = power(a, &own.axis, &matter.wrench);
    let sum = &mut result.torque[body.coordinate];
    *sum = a.combine([(1.0, *sum), (body.ratio, torque)]);
    let with = Products::new(a, own, matter);
    let mut current = Some(index);
    while let Some(other) = current {
        let towards = &tree.bodies[other];
        let pair = with.derivatives(a, &bodies[other].motion, other != index);
        add_pair(a, [body, towards], tree.coordinates, &pair, result);
        current = towards.parent;
    }
}

/// Factors of the derivatives that pair a joint i with the joints from the base to it.
struct Products<V> {
    /// B^T S_i, angular part; the linear part is 0.
    coriolis: [V; 3],
    /// I S_i
    inertia: Pair<V>,
    /// B psi_i + I chi_i + f x S_i
    by_position: Pair<V>,
    /// B S_i + 2 I psi_i
    by_speed: Pair<V>,
}

/// Derivatives of the torques of joints i and j: `row` is that of i by j, `column` that of j by i.
struct PairDerivatives<V> {
    position_row: V,
    speed_row: V,
    acceleration: V,
    /// Derivatives of torque j by position and speed i; `None` for the pair of a joint with itself.
    columns: Option<[V; 2]>,
}

impl<V: Copy> Products<V> {
    /// The factors of a joint; `matter` includes the bodies behind it.
    #[inline(always)]
    fn new<A: Algebra<Value = V>>(a: &mut A, own: &Motion<V>, matter: &Matter<V>) -> Self {
        let half = matter.half_coriolis_transposed(a, &own.axis);
        let coriolis = a.add3(half, half);
        let inertia = matter.times_inertia(a, &own.axis);
        // f x S
        let [turn, speed] = own.axis;
        let [moment, force] = matter.wrench;
        let (first, second) = (a.cross(turn, moment), a.cross(speed, force));
        let bent = [a.add3(first, second), a.cross(turn, force)];
        let changed = matter.times_inertia(a, &own.axis_change);
        let swung = matter.times_half_coriolis(a, own.axis_rate[0]);
        let [turning, force] = [twice_plus(a, swung[0], changed[0]), twice_plus(a, swung[1], changed[1])];
        let by_position = [a.add3(turning, bent[0]), a.add3(force, bent[1])];
        let carried = matter.times_inertia(a, &own.axis_rate);
        let swung = matter.times_half_coriolis(a, turn);
        let [turning, force] = [a.add3(swung[0], carried[0]), a.add3(swung[1], carried[1])];
        let by_speed = [a.add3(turning, turning), a.add3(force, force)];
        Products { coriolis, inertia, by_position, by_speed }
    }

    /// Derivatives of the pair with a joint `other` towards the base, or with the joint itself.
    #[inline(always)]
    fn derivatives<A: Algebra<Value = V>>(
        &self,
        a: &mut A,
        other: &Motion<V>,
        is_before: bool,
    ) -> PairDerivatives<V> {
        let swung = a.dot(self.coriolis, other.axis_rate[0]);
        let carried = power(a, &self.inertia, &other.axis_change);
        let position_row = a.add(swung, carried);
        let swung = a.dot(self.coriolis, other.axis[0]);
        let carried = power(a, &self.inertia, &other.axis_rate);
        let carried = a.add(carried, carried);
        let speed_row = a.add(swung, carried);
        let acceleration = power(a, &self.inertia, &other.axis);
        let columns = is_before
            .then(|| [power(a, &other.axis, &self.by_position), power(a, &other.axis, &self.by_speed)]);
        PairDerivatives { position_row, speed_row, acceleration, columns }
    }
}

/// Adds the derivatives of a pair of joints to those of their coordinates.
#[inline(always)]
fn add_pair<A: Algebra>(
    a: &mut A,
    [body, towards]: [&Body; 2],
    coordinates: usize,
    pair: &PairDerivatives<A::Value>,
    result: &mut TorqueDerivatives<A::Value>,
) {
    let factor = body.ratio * towards.ratio;
    let mut add = |sum: &mut A::Value, value: A::Value| *sum = a.combine([(1.0, *sum), (factor, value)]);
    let row = body.coordinate * coordinates + towards.coordinate;
    add(&mut result.position[row], pair.position_row);
    add(&mut result.speed[row], pair.speed_row);
    add(&mut result.acceleration[row], pair.acceleration);
    if let Some([position, speed]) = pair.columns {
        let column = towards.coordinate * coordinates + body.coordinate;
        add(&mut result.position[column], position);
        add(&mut result.speed[column], speed);
        add(&mut result.acceleration[column], pair.acceleration);
    }
}
