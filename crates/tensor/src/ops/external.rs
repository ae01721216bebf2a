//! A function whose values and Jacobian the caller computes.

use super::Op;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records a function of `x [time, in, batch]` with given `values [time, out, batch]` and Jacobian.
    ///
    /// The function must act on each time and batch entry separately, so that the Jacobian is `[time, out,
    /// in, batch]`. An example is a physics step that is differentiated by dual numbers.
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
    /// [`TensorError::BadShape`] unless `x` has three axes, [`TensorError::WrongLength`] for values or a
    /// Jacobian of other extents.
    pub fn external(&mut self, x: Var, out: usize, values: &[T], jacobian: &[T]) -> Result<Var, TensorError> {
        let shape = self.shape(x);
        let &[time, inputs, batch] = shape.dims() else {
            let rule = "an external function needs [time, feature, batch]";
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
        let mut saved = self.pool.take(jacobian.len());
        saved.copy_from_slice(jacobian);
        self.save(v, saved);
        Ok(v)
    }
}

/// Adds the gradient of `x`: `dx[t, i, b] += sum_o J[t, o, i, b] dy[t, o, b]`, J the given Jacobian.
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
