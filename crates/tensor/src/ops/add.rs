//! Sum of two tensors, with broadcasting.

use super::Op;
use super::elementwise::vectorised;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the sum of two tensors, with broadcasting.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2, 2], &[1.0, 2.0, 3.0, 4.0])?;
    /// let row = tape.variable(&[2], &[10.0, 20.0])?;
    /// let y = tape.add(a, row)?;
    /// assert_eq!(tape.value(y), [11.0, 22.0, 13.0, 24.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn add(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Add, a, b, |x, y| x + y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    for v in [a, b] {
        tape.contribute(v, |d, fresh, _| match fresh {
            true => d.copy_from_slice(grad),
            false => vectorised(|| d.iter_mut().zip(grad).for_each(|(d, g)| *d += *g)),
        });
    }
}
