//! Exponential, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the exponential of every element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[0.0, 1.0])?;
    /// let y = tape.exp(a)?;
    /// assert_eq!(tape.value(y), [1.0, 1f64.exp()]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn exp(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Exp(a), a, |x| x.exp())
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    tape.map_vjp(a, out, grad, |y| y);
}
