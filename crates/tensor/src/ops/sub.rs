//! Difference of two tensors, with broadcasting.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the difference of two tensors, with broadcasting.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[3.0, 5.0])?;
    /// let one = tape.constant(&[1], &[1.0])?;
    /// let y = tape.sub(a, one)?;
    /// assert_eq!(tape.value(y), [2.0, 4.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn sub(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Sub, a, b, |x, y| x - y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |_| T::ONE);
    tape.map_vjp(b, b, grad, |_| -T::ONE);
}
