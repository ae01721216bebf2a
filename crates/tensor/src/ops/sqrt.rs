//! Square root, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Square root, element by element.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn sqrt(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Sqrt(a), a, |x| x.sqrt())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| T::of(0.5) / y);
}
