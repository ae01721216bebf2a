//! Difference of two tensors, with broadcasting.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Difference of two tensors, with broadcasting.
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn sub(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Sub, a, b, |x, y| x - y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |_| T::ONE);
    tape.map_vjp(b, b, grad, |_| -T::ONE);
}
