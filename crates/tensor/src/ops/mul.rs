//! Product of two tensors, element by element, with broadcasting.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the product of two tensors, element by element, with broadcasting.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[3.0, 5.0])?;
    /// let y = tape.mul(a, a)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!((tape.value(y), tape.grad(a)), (&[9.0, 25.0][..], &[6.0, 10.0][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn mul(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Mul, a, b, |x, y| x * y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    tape.map_vjp(a, b, grad, |y| y);
    tape.map_vjp(b, a, grad, |x| x);
}
