//! Selects a range of a tensor along one axis.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the elements of `a` with indices `start..end` along `axis`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[4], &[1.0, 2.0, 3.0, 4.0])?;
    /// let y = tape.slice(a, 0, 1, 3)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!((tape.value(y), tape.grad(a)), (&[2.0, 3.0][..], &[0.0, 1.0, 1.0, 0.0][..]));
    /// assert!(tape.slice(a, 0, 3, 5).is_err());
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::OutOfRange`] if the range does not lie within the axis.
    pub fn slice(&mut self, a: Var, axis: usize, start: usize, end: usize) -> Result<Var, TensorError> {
        let shape = self.shape(a);
        if axis >= shape.rank() || start > end || end > shape.dims()[axis] {
            return Err(TensorError::OutOfRange { op: "slice", shape, axis, start, end });
        }
        let (outer, extent, inner) = shape.split_at_axis(axis);
        let width = (end - start) * inner;
        let mut out = self.pool.take(outer * width);
        let x = self.value(a);
        for o in 0..outer {
            out[o * width..][..width].copy_from_slice(&x[(o * extent + start) * inner..][..width]);
        }
        self.push(Op::Slice { a, axis, start }, shape.with(axis, end - start), self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, axis: usize, start: usize, out: Var, grad: &[T]) {
    let (outer, extent, inner) = tape.shape(a).split_at_axis(axis);
    let width = tape.shape(out).dims()[axis] * inner;
    tape.accumulate(a, |da, _| {
        for o in 0..outer {
            let to = &mut da[(o * extent + start) * inner..][..width];
            for (t, g) in to.iter_mut().zip(&grad[o * width..][..width]) {
                *t += *g;
            }
        }
    });
}
