//! Concatenation of tensors along one axis.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Concatenates the tensors `parts` along `axis`, in order.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let a = tape.constant(&[2, 1], &[1.0, 2.0])?;
    /// let b = tape.constant(&[2, 2], &[3.0, 4.0, 5.0, 6.0])?;
    /// let y = tape.concat(&[a, b], 1)?;
    /// assert_eq!((tape.shape(y).dims(), tape.value(y)), (&[2, 3][..], &[1.0, 3.0, 4.0, 2.0, 5.0, 6.0][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] if there are no parts or no such axis, [`TensorError::ShapeMismatch`]
    /// if two parts differ on another axis.
    pub fn concat(&mut self, parts: &[Var], axis: usize) -> Result<Var, TensorError> {
        let Some(&head) = parts.first() else {
            let (shape, rule) = (crate::Shape::SCALAR, "there must be at least one part");
            return Err(TensorError::BadShape { op: "concat", shape, rule });
        };
        let shape = self.shape(head);
        if axis >= shape.rank() {
            let rule = "the axis to join along does not exist";
            return Err(TensorError::BadShape { op: "concat", shape, rule });
        }
        let mut extent = 0;
        for &p in parts {
            let other = self.shape(p);
            if other.rank() != shape.rank() || other.with(axis, 0) != shape.with(axis, 0) {
                let rule = "the shapes may differ only on the axis to join along";
                return Err(TensorError::ShapeMismatch { op: "concat", left: shape, right: other, rule });
            }
            extent += other.dims()[axis];
        }
        let joined = shape.with(axis, extent);
        let (outer, _, inner) = joined.split_at_axis(axis);
        let mut out = self.pool.take(joined.len());
        let mut offset = 0;
        for &p in parts {
            let width = self.shape(p).dims()[axis] * inner;
            let x = self.value(p);
            for o in 0..outer {
                let to = o * extent * inner + offset;
                out[to..to + width].copy_from_slice(&x[o * width..][..width]);
            }
            offset += width;
        }
        let first = self.args.len();
        self.args.extend_from_slice(parts);
        let op = Op::Concat { first, count: parts.len(), axis };
        self.push(op, joined, self.needs_grad(parts), out)
    }
}

pub(super) fn vjp<T: Scalar>(
    tape: &mut Tape<T>,
    first: usize,
    count: usize,
    axis: usize,
    out: Var,
    grad: &[T],
) {
    let (outer, extent, inner) = tape.shape(out).split_at_axis(axis);
    let mut offset = 0;
    for i in first..first + count {
        let part = tape.args[i];
        let width = tape.shape(part).dims()[axis] * inner;
        let (mut d, fresh) = tape.take_grad_to_write(part);
        if !d.is_empty() {
            for o in 0..outer {
                let from = &grad[o * extent * inner + offset..][..width];
                let to = &mut d[o * width..][..width];
                if fresh {
                    to.copy_from_slice(from);
                } else {
                    to.iter_mut().zip(from).for_each(|(d, g)| *d += *g);
                }
            }
            tape.put_grad(part, d);
        }
        offset += width;
    }
}
