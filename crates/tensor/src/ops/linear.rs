//! Affine map over the feature axis of a sequence, optionally followed by tanh.

use super::Op;
use crate::kernels::{LinearBackward, LinearDims, LinearForward};
use crate::{Scalar, Shape, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records `w x + b`, `[time, out, batch]`, for `x [time, in, batch]`, `w [out, in]` and `b [out]`.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let x = tape.constant(&[2, 1, 2], &[1.0, 2.0, 3.0, 4.0])?; // two steps, one feature, two sequences
    /// let w = tape.constant(&[2, 1], &[1.0, 10.0])?;
    /// let b = tape.constant(&[2], &[0.0, 0.5])?;
    /// let y = tape.linear(x, w, b)?;
    /// assert_eq!(tape.shape(y).dims(), [2, 2, 2]);
    /// assert_eq!(tape.value(y), [1.0, 2.0, 10.5, 20.5, 3.0, 4.0, 30.5, 40.5]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] or [`TensorError::ShapeMismatch`].
    pub fn linear(&mut self, x: Var, w: Var, b: Var) -> Result<Var, TensorError> {
        self.linear_layer(x, w, b, false)
    }

    /// Records tanh of [`Tape::linear`], computed in one pass.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let x = tape.constant(&[1, 1, 2], &[0.0, 0.5])?;
    /// let w = tape.constant(&[1, 1], &[2.0])?;
    /// let b = tape.constant(&[1], &[0.0])?;
    /// let y = tape.linear_tanh(x, w, b)?;
    /// assert_eq!(tape.value(y), [0.0, 1f64.tanh()]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Tape::linear`].
    pub fn linear_tanh(&mut self, x: Var, w: Var, b: Var) -> Result<Var, TensorError> {
        self.linear_layer(x, w, b, true)
    }

    fn linear_layer(&mut self, x: Var, w: Var, b: Var, tanh: bool) -> Result<Var, TensorError> {
        let (sx, sw, sb) = (self.shape(x), self.shape(w), self.shape(b));
        let (time, input, batch) = sx.sequence("linear")?;
        let rule = "w must be [out, in] for x [time, in, batch]";
        let &[output, w_in] = sw.dims() else {
            return Err(TensorError::ShapeMismatch { op: "linear", left: sx, right: sw, rule });
        };
        if w_in != input {
            return Err(TensorError::ShapeMismatch { op: "linear", left: sx, right: sw, rule });
        }
        if sb.dims() != [output] {
            let rule = "the bias must be [out] for w [out, in]";
            return Err(TensorError::ShapeMismatch { op: "linear", left: sw, right: sb, rule });
        }
        let dims = LinearDims { time, input, output, batch };
        let mut y = self.pool.take(time * output * batch);
        let mut scratch = self.pool.take(T::linear_scratch(input, output));
        let args =
            LinearForward { dims, w: self.value(w), b: self.value(b), x: self.value(x), y: &mut y, tanh };
        T::linear_forward(args, &mut scratch);
        self.pool.give(scratch);
        self.push(
            Op::Linear { x, w, b, tanh },
            Shape::new(&[time, output, batch])?,
            self.needs_grad(&[x, w, b]),
            y,
        )
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, [x, w, b]: [Var; 3], tanh: bool, out: Var, grad: &[T]) {
    let (&[time, input, batch], &[output, _]) = (tape.shape(x).dims(), tape.shape(w).dims()) else { return };
    let dims = LinearDims { time, input, output, batch };
    let mut scratch = tape.pool.take(T::linear_scratch(input, output));
    let (mut dx, dx_fresh) = tape.take_grad_to_write(x);
    let (mut dw, dw_wanted) = tape.take_grad_or_scratch(w);
    let (mut db, db_wanted) = tape.take_grad_or_scratch(b);
    let args = LinearBackward {
        dims,
        w: tape.value(w),
        x: tape.value(x),
        y: if tanh { tape.value(out) } else { &[] },
        dy: grad,
        dx: &mut dx,
        dx_fresh,
        dw: &mut dw,
        db: &mut db,
    };
    T::linear_backward(args, &mut scratch);
    tape.pool.give(scratch);
    tape.put_grad(x, dx);
    tape.put_grad_or_scratch(w, dw, dw_wanted);
    tape.put_grad_or_scratch(b, db, db_wanted);
}
