//! Quotient of two tensors, element by element, with broadcasting.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the quotient of two tensors, element by element, with broadcasting.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.constant(&[2], &[3.0, 5.0])?;
    /// let b = tape.variable(&[2], &[2.0, 4.0])?;
    /// let y = tape.div(a, b)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!(tape.value(y), [1.5, 1.25]);
    /// assert_eq!(tape.grad(b), [-0.75, -0.3125]); // -a / b²
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if the shapes do not broadcast.
    pub fn div(&mut self, a: Var, b: Var) -> Result<Var, TensorError> {
        self.zip(Op::Div, a, b, |x, y| x / y)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, b: Var, grad: &[T]) {
    tape.map_vjp(a, b, grad, |y| T::ONE / y);
    tape.accumulate(b, |db, tape| {
        let (x, y) = (tape.value(a), tape.value(b));
        for (((db, g), x), y) in db.iter_mut().zip(grad).zip(x).zip(y) {
            *db -= *g * *x / (*y * *y);
        }
    });
}
