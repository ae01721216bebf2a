//! Softplus, ln(1 + exp(x)), element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records softplus, ln(1 + exp(x)), of every element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[0.0, 800.0])?; // exp(800) would overflow
    /// let y = tape.softplus(a)?;
    /// assert_eq!(tape.value(y), [2f64.ln(), 800.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn softplus(&mut self, a: Var) -> Result<Var, TensorError> {
        let mut out = self.pool.take(self.shape(a).len());
        T::softplus_forward(self.value(a), &mut out);
        self.push(Op::Softplus(a), self.shape(a), self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.contribute(a, |da, fresh, tape| T::softplus_backward(tape.value(a), grad, da, fresh));
}
