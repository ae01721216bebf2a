//! Copies a tensor as a constant.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the values of `a` as a constant: no gradient is propagated to `a`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[1], &[3.0])?;
    /// let weight = tape.detach(a)?;
    /// let y = tape.mul(a, weight)?;
    /// tape.backward(y)?;
    /// assert_eq!(tape.grad(a), [3.0]); // not 6: the weight is a constant
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn detach(&mut self, a: Var) -> Result<Var, TensorError> {
        let shape = self.shape(a);
        let mut out = self.pool.take(shape.len());
        out.copy_from_slice(self.value(a));
        self.push(Op::Leaf, shape, false, out)
    }
}
