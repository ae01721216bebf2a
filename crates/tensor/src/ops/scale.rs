//! Multiplication by a constant number.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// `factor * a`.
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn scale(&mut self, a: Var, factor: f64) -> Result<Var, TensorError> {
        let k = T::of(factor);
        self.map(Op::Scale(a, factor), a, |x| x * k)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, factor: f64, grad: &[T]) {
    let k = T::of(factor);
    tape.map_vjp(a, a, grad, |_| k);
}
