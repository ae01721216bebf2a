//! Addition of a constant number.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records `a + offset`, for a constant number `offset`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2], &[1.0, -2.0])?;
    /// let y = tape.shift(a, 0.5)?;
    /// assert_eq!(tape.value(y), [1.5, -1.5]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn shift(&mut self, a: Var, offset: f64) -> Result<Var, TensorError> {
        let k = T::from_f64(offset);
        self.map(Op::Shift(a), a, |x| x + k)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |_| T::ONE);
}
