//! Broadcasting of axes of extent 1, aligned at the last axis.

use super::Op;
use crate::{MAX_RANK, Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Broadcasts `a` to `shape` by NumPy's rule; returns `a` itself if it has that shape.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.variable(&[2, 1], &[1.0, 2.0])?;
    /// let y = tape.broadcast_to(a, augsim_tensor::Shape::new(&[2, 3])?)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!(tape.value(y), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    /// assert_eq!(tape.grad(a), [3.0, 3.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] if `a` cannot be broadcast to `shape`.
    pub fn broadcast_to(&mut self, a: Var, shape: Shape) -> Result<Var, TensorError> {
        let from = self.shape(a);
        if from == shape {
            return Ok(a);
        }
        if Shape::broadcast("broadcast_to", from, shape)? != shape {
            let rule = "only axes of extent 1 can be broadcast";
            return Err(TensorError::ShapeMismatch { op: "broadcast_to", left: from, right: shape, rule });
        }
        let mut out = self.pool.take(shape.len());
        let x = self.value(a);
        for_each_source(from, shape, |to, source| out[to] = x[source]);
        self.push(Op::Broadcast(a), shape, self.needs_grad(&[a]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, a: Var, out: Var, grad: &[T]) {
    let (from, shape) = (tape.shape(a), tape.shape(out));
    tape.accumulate(a, |da, _| for_each_source(from, shape, |to, source| da[source] += grad[to]));
}

/// Calls `f(flat index in the broadcast tensor, flat index in the original)` for every element.
fn for_each_source(from: Shape, to: Shape, mut f: impl FnMut(usize, usize)) {
    let offset = to.rank() - from.rank();
    let mut strides = [0; MAX_RANK];
    let mut stride = 1;
    for (axis, &extent) in from.dims().iter().enumerate().rev() {
        strides[axis + offset] = if extent == 1 { 0 } else { stride };
        stride *= extent;
    }
    let mut index = [0; MAX_RANK];
    for flat in 0..to.len() {
        let source: usize = index.iter().zip(&strides).map(|(i, s)| i * s).sum();
        f(flat, source);
        for axis in (0..to.rank()).rev() {
            index[axis] += 1;
            if index[axis] < to.dims()[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
}
