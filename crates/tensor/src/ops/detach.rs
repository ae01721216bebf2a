//! A copy that gradients do not flow through.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// The values of `a` as a constant.
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
