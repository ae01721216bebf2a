//! ln(1 + exp(x)), element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// ln(1 + exp(x)), element by element.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn softplus(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Softplus(a), a, |x| x.softplus())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |x| x.sigmoid());
}
