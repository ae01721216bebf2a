//! Natural logarithm, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Natural logarithm, element by element.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn ln(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Ln(a), a, |x| x.ln())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |x| T::ONE / x);
}
