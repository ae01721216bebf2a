//! The same elements under another shape.

use super::Op;
use crate::{Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// The elements of `a`, in order, under the shape `dims`.
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
