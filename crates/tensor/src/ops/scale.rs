//! Multiplication by a constant number.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records `factor * a`, for a constant number `factor`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[1.0, -2.0])?;
    /// let y = tape.scale(a, 3.0)?;
    /// assert_eq!(tape.value(y), [3.0, -6.0]);
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!(tape.grad(a), [3.0, 3.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn scale(&mut self, a: Var, factor: f64) -> Result<Var, TensorError> {
        let k = T::from_f64(factor);
        self.map(Op::Scale(a, factor), a, |x| x * k)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, factor: f64, grad: &[T]) {
    let k = T::from_f64(factor);
    tape.map_vjp(a, a, grad, |_| k);
}
