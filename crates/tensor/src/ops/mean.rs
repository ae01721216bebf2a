//! Means over one axis and over all elements.

use super::{Op, sum};
use crate::{Scalar, Shape, Tape, TensorError, Var};

/// Error message for tensors without elements, whose mean is undefined.
const EMPTY_RULE: &str = "the mean of no elements is undefined";

impl<T: Scalar> Tape<T> {
    /// Records the mean over `axis`, which keeps the extent 1.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2, 2], &[1.0, 2.0, 3.0, 6.0])?;
    /// let y = tape.mean(a, 1)?;
    /// assert_eq!((tape.shape(y).dims(), tape.value(y)), (&[2, 1][..], &[1.5, 4.5][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] if there is no such axis or it is empty.
    pub fn mean(&mut self, a: Var, axis: usize) -> Result<Var, TensorError> {
        let shape = self.shape(a);
        let extent = shape.dims().get(axis).copied().unwrap_or(1);
        if extent == 0 {
            return Err(TensorError::BadShape { op: "mean", shape, rule: EMPTY_RULE });
        }
        self.sum_axis(Op::Mean(a, axis), a, axis, T::ONE / T::from_f64(extent as f64))
    }

    /// Records the mean of all elements, a scalar.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[4], &[1.0, 2.0, 3.0, 6.0])?;
    /// let y = tape.mean_all(a)?;
    /// tape.backward(y)?;
    /// assert_eq!((tape.value(y), tape.grad(a)), (&[3.0][..], &[0.25; 4][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] if there are no elements.
    pub fn mean_all(&mut self, a: Var) -> Result<Var, TensorError> {
        let shape = self.shape(a);
        if shape.is_empty() {
            return Err(TensorError::BadShape { op: "mean_all", shape, rule: EMPTY_RULE });
        }
        let mean = self.total(a) / T::from_f64(shape.len() as f64);
        let mut out = self.pool.take(1);
        out[0] = mean;
        self.push(Op::MeanAll(a), Shape::SCALAR, self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, axis: usize, grad: &[T]) {
    let extent = tape.shape(a).dims()[axis];
    sum::broadcast_gradient(tape, a, axis, grad, T::ONE / T::from_f64(extent as f64));
}

pub(super) fn vjp_all<T: Scalar>(tape: &mut Tape<T>, a: Var, grad: &[T]) {
    let g = grad[0] / T::from_f64(tape.shape(a).len() as f64);
    tape.accumulate(a, |da, _| da.iter_mut().for_each(|d| *d += g));
}
