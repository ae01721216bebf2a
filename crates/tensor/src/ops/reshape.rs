//! Gives the elements of a tensor another shape.

use super::Op;
use crate::{Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the elements of `a`, in the same order, with the shape `dims`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])?;
    /// let y = tape.reshape(a, &[3, 2])?;
    /// assert_eq!((tape.shape(y).dims(), tape.value(y)[2]), (&[3, 2][..], 3.0));
    /// assert!(tape.reshape(a, &[4]).is_err());
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the number of elements differs.
    pub fn reshape(&mut self, a: Var, dims: &[usize]) -> Result<Var, TensorError> {
        let (left, right) = (self.shape(a), Shape::new(dims)?);
        if left.len() != right.len() {
            let rule = "both must have the same number of elements";
            return Err(TensorError::ShapeMismatch { op: "reshape", left, right, rule });
        }
        let mut out = self.pool.take(left.len());
        out.copy_from_slice(self.value(a));
        self.push(Op::Reshape(a), right, self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    tape.map_vjp(a, a, grad, |_| T::ONE);
}
