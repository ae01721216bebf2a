//! Matrix product.

use super::Op;
use crate::kernels::MatmulDims;
use crate::{Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the matrix product of `a [m, k]` and `b [k, n]`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.constant(&[1, 2], &[1.0, 2.0])?;
    /// let b = tape.constant(&[2, 3], &[1.0, 0.0, 3.0, 0.0, 1.0, 4.0])?;
    /// let y = tape.matmul(a, b)?;
    /// assert_eq!((tape.shape(y).dims(), tape.value(y)), (&[1, 3][..], &[1.0, 2.0, 11.0][..]));
    /// assert!(tape.matmul(b, a).is_err()); // [2, 3] times [1, 2]
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] unless both are matrices with a common inner extent.
    pub fn matmul(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        let (left, right) = (self.shape(a), self.shape(b));
        let (&[m, k], &[k2, n]) = (left.dims(), right.dims()) else {
            let rule = "both operands must be matrices";
            return Err(TensorError::ShapeMismatch { op: "matmul", left, right, rule });
        };
        if k != k2 {
            let rule = "columns of the first must equal rows of the second";
            return Err(TensorError::ShapeMismatch { op: "matmul", left, right, rule });
        }
        let mut out = self.pool.take_zeroed(m * n);
        let dims = MatmulDims { m, k, n, a_transposed: false, b_transposed: false };
        T::matmul(dims, self.value(a), self.value(b), &mut out, false);
        self.push(Op::Matmul(a, b), Shape::new(&[m, n])?, self.needs_grad(&[a, b]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    let (&[m, k], &[_, n]) = (tape.shape(a).dims(), tape.shape(b).dims()) else { return };
    let dims = MatmulDims { m, k: n, n: k, a_transposed: false, b_transposed: true };
    tape.accumulate(a, |da, tape| T::matmul(dims, grad, tape.value(b), da, true));
    let dims = MatmulDims { m: k, k: m, n, a_transposed: true, b_transposed: false };
    tape.accumulate(b, |db, tape| T::matmul(dims, tape.value(a), grad, db, true));
}
