//! Product of two tensors, element by element, with broadcasting.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Product of two tensors, element by element, with broadcasting.
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn mul(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Mul, a, b, |x, y| x * y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    tape.map_vjp(a, b, grad, |y| y);
    tape.map_vjp(b, a, grad, |x| x);
}
