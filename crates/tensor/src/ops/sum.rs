//! Sums over one axis and over all elements.

use super::Op;
use super::elementwise::vectorised;
use crate::{Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the sum over `axis`, which keeps the extent 1.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])?;
    /// let y = tape.sum(a, 0)?;
    /// assert_eq!((tape.shape(y).dims(), tape.value(y)), (&[1, 3][..], &[5.0, 7.0, 9.0][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] if there is no such axis.
    pub fn sum(&mut self, a: Var, axis: usize) -> Result<Var, TensorError> {
        self.sum_axis(Op::Sum(a, axis), a, axis, T::ONE)
    }

    /// Records the sum of all elements, a scalar.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2, 2], &[1.0, 2.0, 3.0, 4.0])?;
    /// let y = tape.sum_all(a)?;
    /// tape.backward(y)?;
    /// assert_eq!((tape.value(y), tape.grad(a)), (&[10.0][..], &[1.0; 4][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::NotFinite`] when the check is on.
    pub fn sum_all(&mut self, a: Var) -> Result<Var, TensorError> {
        let total = self.total(a);
        let mut out = self.pool.take(1);
        out[0] = total;
        self.push(Op::SumAll(a), Shape::SCALAR, self.needs_grad(&[a]), out)
    }

    /// Computes the sum of all elements by partial sums of 64, so that rounding errors grow slowly.
    pub(super) fn total(&self, a: Var) -> T {
        self.value(a).chunks(64).map(|c| c.iter().copied().sum::<T>()).sum()
    }

    /// Records `k` times the sum of `a` over `axis`.
    pub(super) fn sum_axis(&mut self, op: Op, a: Var, axis: usize, k: T) -> Result<Var, TensorError> {
        let shape = self.shape(a);
        if axis >= shape.rank() {
            let rule = "the axis to reduce does not exist";
            return Err(TensorError::BadShape { op: op.name(), shape, rule });
        }
        let (outer, extent, inner) = shape.split_at_axis(axis);
        let mut out = self.pool.take_zeroed(outer * inner);
        let x = self.value(a);
        vectorised(|| {
            for (o, row) in (0..outer).flat_map(|o| (0..extent).map(move |i| (o, o * extent + i))) {
                let (to, from) = (&mut out[o * inner..][..inner], &x[row * inner..][..inner]);
                for (t, f) in to.iter_mut().zip(from) {
                    *t += *f;
                }
            }
            for v in out.iter_mut() {
                *v *= k;
            }
        });
        self.push(op, shape.with(axis, 1), self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, axis: usize, grad: &[T]) {
    broadcast_gradient(tape, a, axis, grad, T::ONE);
}

/// Adds `k * grad` to the gradient of every element of `a`, where `grad` is that of the sums over `axis`.
pub(super) fn broadcast_gradient<T: Scalar>(tape: &mut Tape<T>, a: Var, axis: usize, grad: &[T], k: T) {
    let (outer, extent, inner) = tape.shape(a).split_at_axis(axis);
    tape.accumulate(a, |da, _| {
        for (o, row) in (0..outer).flat_map(|o| (0..extent).map(move |i| (o, o * extent + i))) {
            let (to, from) = (&mut da[row * inner..][..inner], &grad[o * inner..][..inner]);
            for (t, f) in to.iter_mut().zip(from) {
                *t += *f * k;
            }
        }
    });
}

pub(super) fn vjp_all<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    let g = grad[0];
    tape.contribute(a, |da, fresh, _| match fresh {
        true => da.fill(g),
        false => da.iter_mut().for_each(|d| *d += g),
    });
}
