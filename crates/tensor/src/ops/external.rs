//! A function that the tape does not know: values and Jacobian come from outside.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// The values `[time, out, batch]` of a function of `x [time, in, batch]` that acts on each column (a time and a batch entry) alone, with its
    /// Jacobian `[time, out, in, batch]`, both computed by the caller: a physics step differentiated by dual numbers, say.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let x = tape.variable(&[1, 2, 1], &[3.0, 4.0])?;
    /// // The product of both.
    /// let y = tape.external(x, 1, &[12.0], &[4.0, 3.0])?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!((tape.value(y), tape.grad(x)), (&[12.0][..], &[4.0, 3.0][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] unless `x` has three axes, [`TensorError::WrongLength`] for values or a Jacobian of other extents.
    pub fn external(&mut self, x: Var, out: usize, values: &[T], jacobian: &[T]) -> Result<Var, TensorError> {
        let shape = self.shape(x);
        let &[time, inputs, batch] = shape.dims() else {
            let rule = "a function from outside acts on [time, feature, batch]";
            return Err(TensorError::BadShape { op: "external", shape, rule });
        };
        let result = shape.with(1, out);
        for (found, expected) in
            [(values.len(), time * out * batch), (jacobian.len(), time * out * inputs * batch)]
        {
            if found != expected {
                return Err(TensorError::WrongLength { shape: result, expected, found });
            }
        }
        let mut buffer = self.pool.take(values.len());
        buffer.copy_from_slice(values);
        let v = self.push(Op::External(x), result, self.needs_grad(&[x]), buffer)?;
        let mut kept = self.pool.take(jacobian.len());
        kept.copy_from_slice(jacobian);
        self.save(v, kept);
        Ok(v)
    }
}

/// dx[t, i, b] = sum over o of J[t, o, i, b] dy[t, o, b].
pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, x: Var, out: Var, grad: &[T]) {
    let (inputs, outputs) = (tape.shape(x).dims()[1], tape.shape(out).dims()[1]);
    let batch = tape.shape(x).dims()[2];
    tape.accumulate(x, |dx, tape| {
        let jacobian = tape.saved(out);
        if inputs * outputs * batch == 0 {
            return;
        }
        let rows = jacobian.chunks_exact(inputs * batch).zip(grad.chunks_exact(batch));
        for (row, (j, g)) in rows.enumerate() {
            let dx = &mut dx[row / outputs * inputs * batch..][..inputs * batch];
            for (dx, j) in dx.chunks_exact_mut(batch).zip(j.chunks_exact(batch)) {
                dx.iter_mut().zip(j).zip(g).for_each(|((dx, j), g)| *dx += *j * *g);
            }
        }
    });
}
