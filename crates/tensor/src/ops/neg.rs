//! Negative, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Negative, element by element.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn neg(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Neg(a), a, |x| -x)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |_| -T::ONE);
}
