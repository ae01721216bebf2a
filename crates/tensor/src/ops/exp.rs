//! Exponential, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Exponential, element by element.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn exp(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Exp(a), a, |x| x.exp())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| y);
}
