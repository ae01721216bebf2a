//! Negation, element by element.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the negation of every element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[1.0, -2.0])?;
    /// let y = tape.neg(a)?;
    /// assert_eq!(tape.value(y), [-1.0, 2.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn neg(&mut self, a: Var) -> Result<Var, TensorError> {
        self.map(Op::Neg(a), a, |x| -x)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |_| -T::ONE);
}
