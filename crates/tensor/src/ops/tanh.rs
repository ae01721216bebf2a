//! Hyperbolic tangent, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the hyperbolic tangent of every element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[0.0, 20.0])?;
    /// let y = tape.tanh(a)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!((tape.value(y), tape.grad(a)[0]), (&[0.0, 1.0][..], 1.0));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn tanh(&mut self, a: Var) -> Result<Var, TensorError> {
        let mut out = self.pool.take(self.shape(a).len());
        T::tanh_forward(self.value(a), &mut out);
        self.push(Op::Tanh(a), self.shape(a), self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| T::ONE - y * y);
}
