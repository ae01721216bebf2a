//! Sum of two tensors, with broadcasting.

use super::Op;
use super::elementwise::vectorised;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Sum of two tensors, with broadcasting.
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn add(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Add, a, b, |x, y| x + y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    tape.accumulate(a, |da, _| add_into(da, grad));
    tape.accumulate(b, |db, _| add_into(db, grad));
}

fn add_into<T: Scalar>(to: &mut [T], grad: &[T]) {
    vectorised(|| {
        for (t, g) in to.iter_mut().zip(grad) {
            *t += *g;
        }
    });
}
