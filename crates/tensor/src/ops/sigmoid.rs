//! Logistic function 1 / (1 + exp(-x)), element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the logistic function 1 / (1 + exp(-x)) of every element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[1], &[0.0])?;
    /// let y = tape.sigmoid(a)?;
    /// tape.backward(y)?;
    /// assert_eq!((tape.value(y), tape.grad(a)), (&[0.5][..], &[0.25][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn sigmoid(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Sigmoid(a), a, |x| x.sigmoid())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| y * (T::ONE - y));
}
