//! Joint accelerations from positions, speeds and torques: M(q) acceleration = torque - bias(q, speed).
//!
//! The bias is the torque of a motion without acceleration (`inverse_dynamics.rs`), the mass matrix M comes from the
//! composite-rigid-body algorithm (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, Table 6.2), and the equations are
//! solved by its factors L^T D L (Table 6.3).
//!
//! The articulated-body algorithm computes the accelerations without a mass matrix. It is not used, for two reasons: with
//! coupled joints a coordinate moves several bodies, which it cannot represent, and for arms of up to about ten joints both
//! take about as many operations.

use crate::algebra::Algebra;
use crate::inertia::{added, split};
use crate::inverse_dynamics::{joint_motions, torques};
use crate::joint_motion::JointMotion;
use crate::tree::{Body, Tree};
use crate::vectors::{Vectors, symmetric_rows};

/// Accelerations of the coordinates (rad/s2 or m/s2) under torques or forces (N m or N), without friction.
///
/// `parameters` and `gravity` are those of [`crate::inverse_dynamics`]; `armature` ([`Tree::armature`]), `position`, `speed` and
/// `torque` are by coordinate. Where the mass matrix is singular the values are not finite.
#[expect(
    clippy::too_many_arguments,
    reason = "the quantities of the equations of motion, which callers hold apart"
)]
pub fn forward_dynamics<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    parameters: &[[A::Value; 10]],
    gravity: [A::Value; 3],
    armature: &[A::Value],
    position: &[A::Value],
    speed: &[A::Value],
    torque: &[A::Value],
) -> Vec<A::Value> {
    let still = vec![a.constant(0.0); tree.coordinates];
    let joints = joint_motions(a, tree, position);
    let bias = torques(a, tree, &joints, parameters, gravity, speed, &still);
    let mut acceleration: Vec<_> = torque.iter().zip(&bias).map(|(&t, &b)| a.subtract(t, b)).collect();
    let mut matrix = composite_inertias(a, tree, &joints, parameters, armature);
    let reciprocals = factorise(a, &mut matrix);
    solve(a, &matrix, &reciprocals, &mut acceleration);
    acceleration
}

/// Mass matrix of the coordinates with the armatures on its diagonal, `[row][column]`, kg m2, kg m or kg.
///
/// Derivative of the torques of [`crate::inverse_dynamics`] with respect to the accelerations, plus `armature` by coordinate.
pub fn mass_matrix<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    parameters: &[[A::Value; 10]],
    armature: &[A::Value],
    position: &[A::Value],
) -> Vec<Vec<A::Value>> {
    let joints = joint_motions(a, tree, position);
    composite_inertias(a, tree, &joints, parameters, armature)
}

/// The mass matrix of [`mass_matrix`], from the changes of frame: the composite-rigid-body algorithm.
fn composite_inertias<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    joints: &[JointMotion<'_, A::Value>],
    parameters: &[[A::Value; 10]],
    armature: &[A::Value],
) -> Vec<Vec<A::Value>> {
    let mut composite = parameters.to_vec();
    let mut matrix = vec![vec![a.constant(0.0); tree.coordinates]; tree.coordinates];
    for (k, &armature) in armature.iter().enumerate() {
        matrix[k][k] = armature;
    }
    for (index, body) in tree.bodies.iter().enumerate().rev() {
        // All bodies behind this one are already added to it.
        if let Some(parent) = body.parent {
            let behind = joints[index].parameters_into_parent(a, &composite[index]);
            composite[parent] = added(a, &composite[parent], &behind);
        }
        add_column(a, tree, joints, index, &composite[index], &mut matrix);
    }
    matrix
}

/// Adds the torques that a unit acceleration of one joint needs in it and in the joints towards the base.
fn add_column<A: Algebra>(
    a: &mut A,
    tree: &Tree,
    joints: &[JointMotion<'_, A::Value>],
    index: usize,
    composite: &[A::Value; 10],
    matrix: &mut [Vec<A::Value>],
) {
    let body = &tree.bodies[index];
    let mut wrench = unit_wrench(a, body, composite);
    let mut current = index;
    loop {
        let towards = &tree.bodies[current];
        let [moment, force] = wrench;
        let value = a.dot_constant(towards.axis, if towards.is_prismatic { force } else { moment });
        let value = a.combine([(body.ratio * towards.ratio, value)]);
        let (row, column) = (body.coordinate, towards.coordinate);
        matrix[row][column] = a.add(matrix[row][column], value);
        // The matrix is symmetric; two joints of one coordinate count twice on its diagonal.
        if current != index {
            matrix[column][row] = a.add(matrix[column][row], value);
        }
        let Some(parent) = towards.parent else {
            return;
        };
        wrench = joints[current].wrench_into_parent(a, wrench);
        current = parent;
    }
}

/// Moment and force that a unit acceleration of a body's joint needs, all bodies behind it included.
fn unit_wrench<A: Algebra>(a: &mut A, body: &Body, composite: &[A::Value; 10]) -> [[A::Value; 3]; 2] {
    let (mass, moment, tensor) = split(composite);
    if body.is_prismatic {
        let zero = a.zero3();
        let force = a.add_along(zero, body.axis, mass);
        return [a.cross_constant(body.axis.map(|x| -x), moment), force];
    }
    let turning = a.apply_to_constant(&symmetric_rows(&tensor), body.axis);
    [turning, a.cross_constant(body.axis, moment)]
}

/// Replaces a symmetric matrix by its factors: L below the diagonal, D on it, matrix = L^T D L; returns 1/D.
///
/// Eliminates from the last row on, so that branches of a tree that do not act on each other stay apart (no fill-in).
/// Without pivoting: the matrix must be positive definite. Only the lower triangle is used.
pub(crate) fn factorise<A: Algebra>(a: &mut A, matrix: &mut [Vec<A::Value>]) -> Vec<A::Value> {
    let one = a.constant(1.0);
    let mut reciprocals = vec![one; matrix.len()];
    for k in (0..matrix.len()).rev() {
        let (rows, pivot_row) = matrix.split_at_mut(k);
        let pivot_row = &mut pivot_row[0];
        reciprocals[k] = a.divide(one, pivot_row[k]);
        for i in (0..k).rev() {
            let factor = a.multiply(pivot_row[i], reciprocals[k]);
            for j in 0..=i {
                let product = a.multiply(factor, pivot_row[j]);
                rows[i][j] = a.subtract(rows[i][j], product);
            }
            // No row i' < i needs the element itself any more.
            pivot_row[i] = factor;
        }
    }
    reciprocals
}

/// Solves L^T D L x = b in place, with the factors and reciprocals of [`factorise`].
fn solve<A: Algebra>(a: &mut A, factors: &[Vec<A::Value>], reciprocals: &[A::Value], b: &mut [A::Value]) {
    for k in (0..b.len()).rev() {
        for j in 0..k {
            let product = a.multiply(factors[k][j], b[k]);
            b[j] = a.subtract(b[j], product);
        }
    }
    for (value, &reciprocal) in b.iter_mut().zip(reciprocals) {
        *value = a.multiply(*value, reciprocal);
    }
    for k in 0..b.len() {
        for j in 0..k {
            let product = a.multiply(factors[k][j], b[j]);
            b[k] = a.subtract(b[k], product);
        }
    }
}
