//! Square root, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the square root of every element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[4.0, 9.0])?;
    /// let y = tape.sqrt(a)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!(tape.value(y), [2.0, 3.0]);
    /// assert_eq!(tape.grad(a)[0], 0.25); // 1 / (2 sqrt a)
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn sqrt(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Sqrt(a), a, |x| x.sqrt())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| T::from_f64(0.5) / y);
}
