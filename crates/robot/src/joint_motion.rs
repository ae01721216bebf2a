//! The change of frame across a joint: from the frame of the parent body to that of the body, and back.

use crate::algebra::Algebra;
use crate::inertia::{joined, shifted, split};
use crate::tree::Body;
use crate::vectors::{STORED, Vectors, rotation_terms, transposed, turned_tensor};

/// Rotation or translation of a joint from its reference.
enum Moved<V> {
    /// Rotation about a coordinate axis of the frame.
    AboutFrameAxis { axis: usize, cos: V, sin: V },
    /// Rotation about another axis, as a matrix.
    About([[V; 3]; 3]),
    /// Translation along the axis, m.
    Along(V),
}

/// A body's frame in the frame of its parent, at one position of its joint.
pub(crate) struct JointMotion<'t, V> {
    body: &'t Body,
    moved: Moved<V>,
}

impl<'t, V: Copy> JointMotion<'t, V> {
    /// The change of frame at the positions of the coordinates, rad or m.
    #[inline(always)]
    pub(crate) fn new<A: Algebra<Value = V>>(a: &mut A, body: &'t Body, position: &[V]) -> Self {
        let mut displacement = a.combine([(body.ratio, position[body.coordinate])]);
        if body.offset != 0.0 {
            let offset = a.constant(body.offset);
            displacement = a.add(displacement, offset);
        }
        if body.is_prismatic {
            return JointMotion { body, moved: Moved::Along(displacement) };
        }
        let (cos, sin) = (a.cos(displacement), a.sin(displacement));
        let moved = match body.axis.iter().position(|x| x.abs() == 1.0) {
            Some(axis) => Moved::AboutFrameAxis { axis, cos, sin: a.combine([(body.axis[axis], sin)]) },
            None => Moved::About(rotation(a, body.axis, cos, sin)),
        };
        JointMotion { body, moved }
    }

    /// Coordinates in the body frame of a direction given in the parent frame.
    #[inline(always)]
    pub(crate) fn direction_in_body<A: Algebra<Value = V>>(&self, a: &mut A, x: [V; 3]) -> [V; 3] {
        let x = a.apply_constant(&transposed(&self.body.placement.rotation), x);
        match &self.moved {
            Moved::AboutFrameAxis { axis, cos, sin } => {
                let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut turned = x;
                turned[i] = a.sum_of_products([*cos, x[i]], [*sin, x[j]]);
                turned[j] = a.difference_of_products([*cos, x[j]], [*sin, x[i]]);
                turned
            }
            Moved::About(rotation) => a.apply(&transposed(rotation), x),
            Moved::Along(_) => x,
        }
    }

    /// Coordinates in the frame of the joint at its reference of a direction given in the body frame.
    #[inline(always)]
    fn direction_in_reference<A: Algebra<Value = V>>(&self, a: &mut A, x: [V; 3]) -> [V; 3] {
        match &self.moved {
            Moved::AboutFrameAxis { axis, cos, sin } => {
                let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut turned = x;
                turned[i] = a.difference_of_products([*cos, x[i]], [*sin, x[j]]);
                turned[j] = a.sum_of_products([*sin, x[i]], [*cos, x[j]]);
                turned
            }
            Moved::About(rotation) => a.apply(rotation, x),
            Moved::Along(_) => x,
        }
    }

    /// Velocity (angular, of the origin) of the body's frame if it were fixed to its parent, from the parent's velocity.
    #[inline(always)]
    pub(crate) fn carried<A: Algebra<Value = V>>(
        &self,
        a: &mut A,
        [turn, speed]: [[V; 3]; 2],
    ) -> [[V; 3]; 2] {
        // Velocity of the point p of the parent: v + turn x p = v - p x turn.
        let p = self.body.placement.translation_m;
        let lever = a.cross_constant(p.map(|x| -x), turn);
        let speed = a.add3(speed, lever);
        let (turn, mut speed) = (self.direction_in_body(a, turn), self.direction_in_body(a, speed));
        if let Moved::Along(d) = self.moved {
            let lever = a.cross_constant(self.body.axis.map(|x| -x), turn);
            let lever = a.scale3(d, lever);
            speed = a.add3(speed, lever);
        }
        [turn, speed]
    }

    /// Moment about the parent's origin and force in the parent frame, from those about and in the body frame.
    #[inline(always)]
    pub(crate) fn wrench_into_parent<A: Algebra<Value = V>>(
        &self,
        a: &mut A,
        [moment, force]: [[V; 3]; 2],
    ) -> [[V; 3]; 2] {
        let (mut moment, force) =
            (self.direction_in_reference(a, moment), self.direction_in_reference(a, force));
        if let Moved::Along(d) = self.moved {
            let lever = a.cross_constant(self.body.axis, force);
            let lever = a.scale3(d, lever);
            moment = a.add3(moment, lever);
        }
        let rotation = &self.body.placement.rotation;
        let (moment, force) = (a.apply_constant(rotation, moment), a.apply_constant(rotation, force));
        let lever = a.cross_constant(self.body.placement.translation_m, force);
        [a.add3(moment, lever), force]
    }

    /// Acceleration of the body's origin if the joint stood still, in the body frame.
    ///
    /// `acceleration` is that of the parent's origin and `gradient` the matrix W of `inverse_dynamics.rs` in the parent frame.
    #[inline(always)]
    pub(crate) fn acceleration_of_origin<A: Algebra<Value = V>>(
        &self,
        a: &mut A,
        acceleration: [V; 3],
        gradient: &[[V; 3]; 3],
    ) -> [V; 3] {
        let p = self.body.placement.translation_m;
        let difference = a.apply_to_constant(gradient, p);
        let at_reference = a.add3(acceleration, difference);
        self.direction_in_body(a, at_reference)
    }

    /// Distance along the axis from the reference of a prismatic joint; `None` for a revolute one.
    #[inline(always)]
    pub(crate) fn distance(&self) -> Option<V> {
        match self.moved {
            Moved::Along(d) => Some(d),
            _ => None,
        }
    }

    /// The ten parameters in the parent frame, from those in the body frame.
    #[inline(always)]
    pub(crate) fn parameters_into_parent<A: Algebra<Value = V>>(
        &self,
        a: &mut A,
        parameters: &[V; 10],
    ) -> [V; 10] {
        let (mass, moment, tensor) = split(parameters);
        let turned = match &self.moved {
            Moved::AboutFrameAxis { axis, cos, sin } => {
                let moment = self.direction_in_reference(a, moment);
                joined((mass, moment, turned_about_axis(a, &tensor, *axis, *cos, *sin)))
            }
            Moved::About(rotation) => {
                let moment = a.apply(rotation, moment);
                joined((mass, moment, turned_tensor(a, &tensor, |a, x| a.apply(rotation, x))))
            }
            Moved::Along(d) => slid(a, parameters, self.body.axis, *d),
        };
        crate::inertia::moved(a, &turned, &self.body.placement)
    }
}

/// Rotation matrix about an axis, from the cosine and sine of the angle: Rodrigues' formula.
fn rotation<A: Algebra>(a: &mut A, axis: [f64; 3], cos: A::Value, sin: A::Value) -> [[A::Value; 3]; 3] {
    let [along, across, skew] = rotation_terms(axis);
    let one = a.constant(1.0);
    [0, 1, 2]
        .map(|i| [0, 1, 2].map(|j| a.combine([(along[i][j], one), (across[i][j], cos), (skew[i][j], sin)])))
}

/// Symmetric tensor after a rotation about a coordinate axis.
fn turned_about_axis<A: Algebra>(
    a: &mut A,
    tensor: &[A::Value; 6],
    axis: usize,
    cos: A::Value,
    sin: A::Value,
) -> [A::Value; 6] {
    let (i, j, k) = ((axis + 1) % 3, (axis + 2) % 3, axis);
    let [ii, jj, ij] = [STORED[i][i], STORED[j][j], STORED[i][j]];
    let [ik, jk] = [STORED[i][k], STORED[j][k]];
    let (sin_cos, sin_sin) = (a.multiply(sin, cos), a.multiply(sin, sin));
    let (excess, product) = (a.subtract(tensor[ii], tensor[jj]), tensor[ij]);
    // ii' = ii - (ii - jj) sin^2 - 2 ij sin cos, and the trace stays.
    let doubled = a.add(product, product);
    let change = a.sum_of_products([sin_sin, excess], [sin_cos, doubled]);
    let mut turned = *tensor;
    turned[ii] = a.subtract(tensor[ii], change);
    turned[jj] = a.add(tensor[jj], change);
    // ij' = ij + (ii - jj) sin cos - 2 ij sin^2
    let change = a.difference_of_products([sin_cos, excess], [sin_sin, doubled]);
    turned[ij] = a.add(product, change);
    turned[ik] = a.difference_of_products([cos, tensor[ik]], [sin, tensor[jk]]);
    turned[jk] = a.sum_of_products([sin, tensor[ik]], [cos, tensor[jk]]);
    turned
}

/// The ten parameters after a translation by `distance` along a constant axis: a polynomial in the distance.
fn slid<A: Algebra>(
    a: &mut A,
    parameters: &[A::Value; 10],
    axis: [f64; 3],
    distance: A::Value,
) -> [A::Value; 10] {
    // The change by the moment is linear in the distance, that of the tensor by the mass quadratic.
    let (mass, moment, tensor) = split(parameters);
    let zero = a.constant(0.0);
    let linear = shifted(a, (zero, moment, [zero; 6]), axis);
    let quadratic = shifted(a, (mass, [zero; 3], [zero; 6]), axis);
    let mut result = joined((mass, moment, tensor));
    for k in 1..4 {
        let change = a.multiply(distance, quadratic[k]);
        result[k] = a.add(result[k], change);
    }
    for k in 4..10 {
        let slope = a.multiply(distance, quadratic[k]);
        let slope = a.add(linear[k], slope);
        let change = a.multiply(distance, slope);
        result[k] = a.add(result[k], change);
    }
    result
}
