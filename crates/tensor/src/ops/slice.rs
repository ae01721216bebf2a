//! A range of one axis.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// The part `start..end` of `axis`.
    ///
    /// # Errors
    /// [`TensorError::OutOfRange`] if the range does not lie within the axis.
    pub fn slice(&mut self, a: Var, axis: usize, start: usize, end: usize) -> Result<Var, TensorError> {
        let shape = self.shape(a);
        if axis >= shape.rank() || start > end || end > shape.dims()[axis] {
            return Err(TensorError::OutOfRange { op: "slice", shape, axis, start, end });
        }
        let (outer, extent, inner) = shape.around(axis);
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
    let (outer, extent, inner) = tape.shape(a).around(axis);
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
