//! Hyperbolic tangent, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Hyperbolic tangent, element by element.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn tanh(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Tanh(a), a, |x| x.tanh())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| T::ONE - y * y);
}
