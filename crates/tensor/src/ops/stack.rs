//! Stacking of tensors of equal shape along a new first axis, time.

use super::Op;
use crate::{MAX_RANK, Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Stacks steps of shape `[feature, batch]`, or of any other equal shape, to `[time, feature, batch]`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let steps = [1.0, 2.0, 3.0].map(|x| tape.constant(&[1, 2], &[x, -x]));
    /// let [a, b, c] = steps;
    /// let y = tape.stack_time(&[a?, b?, c?])?;
    /// assert_eq!(tape.shape(y).dims(), [3, 1, 2]);
    /// assert_eq!(tape.value(y), [1.0, -1.0, 2.0, -2.0, 3.0, -3.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] for no steps, [`TensorError::ShapeMismatch`] for unequal ones,
    /// [`TensorError::RankTooHigh`] if the steps have [`MAX_RANK`] axes already.
    pub fn stack_time(&mut self, steps: &[Var]) -> Result<Var, TensorError> {
        let Some(&head) = steps.first() else {
            let rule = "there must be at least one step";
            return Err(TensorError::BadShape { op: "stack_time", shape: Shape::SCALAR, rule });
        };
        let step = self.shape(head);
        let mut dims = [0; MAX_RANK + 1];
        dims[0] = steps.len();
        dims[1..=step.rank()].copy_from_slice(step.dims());
        let shape = Shape::new(&dims[..=step.rank()])?;
        for &s in steps {
            super::elementwise::same_shape("stack_time", step, self.shape(s))?;
        }
        let width = step.len();
        let mut out = self.pool.take(shape.len());
        for (i, &s) in steps.iter().enumerate() {
            out[i * width..][..width].copy_from_slice(self.value(s));
        }
        let first = self.args.len();
        self.args.extend_from_slice(steps);
        self.push(Op::Stack { first, count: steps.len() }, shape, self.needs_grad(steps), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, first: usize, count: usize, grad: &[T]) {
    for i in 0..count {
        let step = tape.args[first + i];
        let width = tape.shape(step).len();
        tape.accumulate(step, |d, _| {
            for (d, g) in d.iter_mut().zip(&grad[i * width..][..width]) {
                *d += *g;
            }
        });
    }
}
