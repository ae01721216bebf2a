//! One GRU layer over a whole sequence as one operation, with a hand-written vector-Jacobian product.
//!
//! [`Tape::gru_composed`] is the same layer, composed of elementary operations.

use super::Op;
use crate::kernels::{GruBackward, GruDims, GruForward, GruWeights};
use crate::{Scalar, Shape, Tape, TensorError, Var};

/// Weights of one GRU layer in PyTorch's layout (`torch.nn.GRU`): rows are the gates r, z, n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GruVars {
    /// Input weights `[3H, I]` (H hidden units, I inputs).
    pub w_ih: Var,
    /// Recurrent weights `[3H, H]` (H hidden units).
    pub w_hh: Var,
    /// Input biases `[3H]` (H hidden units).
    pub b_ih: Var,
    /// Recurrent biases `[3H]` (H hidden units).
    pub b_hh: Var,
}

impl GruVars {
    fn operands(self) -> [Var; 4] {
        [self.w_ih, self.w_hh, self.b_ih, self.b_hh]
    }
}

impl<T: Scalar> Tape<T> {
    /// Records the hidden states `[time, hidden, batch]` of a GRU layer for inputs `x [time, input, batch]`.
    ///
    /// `h0 [hidden, batch]` is the initial state, 0 if it is `None`. With the reset gate r, the update gate z
    /// and the candidate state n:
    ///
    /// ```text
    /// r  = sigmoid(W_ir x + b_ir + W_hr h + b_hr)
    /// z  = sigmoid(W_iz x + b_iz + W_hz h + b_hz)
    /// n  = tanh(W_in x + b_in + r (W_hn h + b_hn))
    /// h' = (1 - z) n + z h
    /// ```
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// // One unit, one input, one sequence; all weights 0, so that every gate is 1/2 and the new state is 0.
    /// let [w_ih, w_hh] = [tape.constant(&[3, 1], &[0.0; 3])?, tape.constant(&[3, 1], &[0.0; 3])?];
    /// let [b_ih, b_hh] = [tape.constant(&[3], &[0.0; 3])?, tape.constant(&[3], &[0.0; 3])?];
    /// let x = tape.constant(&[3, 1, 1], &[1.0, 2.0, 3.0])?;
    /// let h0 = tape.variable(&[1, 1], &[1.0])?;
    /// let w = augsim_tensor::GruVars { w_ih, w_hh, b_ih, b_hh };
    /// let h = tape.gru_sequence(x, Some(h0), w)?;
    /// assert_eq!(tape.value(h), [0.5, 0.25, 0.125]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::BadShape`] or [`TensorError::ShapeMismatch`] naming the shapes that do not fit.
    pub fn gru_sequence(&mut self, x: Var, h0: Option<Var>, w: GruVars) -> Result<Var, TensorError> {
        let dims = self.gru_dims(x, h0, w)?;
        let (time, hidden, batch) = (dims.time, dims.hidden, dims.batch);
        let needs = self.needs_grad(&[x]) || self.needs_grad(&w.operands()) || self.needs_grad(h0.as_slice());
        let mut y = self.pool.take(time * hidden * batch);
        let mut saved = self.pool.take(if needs { 4 * time * hidden * batch } else { 0 });
        let mut scratch = self.pool.take(T::gru_scratch(dims.input, hidden));
        let args = GruForward {
            dims,
            weights: self.gru_weights(w),
            x: self.value(x),
            h0: h0.map_or(&[], |h| self.value(h)),
            y: &mut y,
            saved: &mut saved,
        };
        T::gru_forward(args, &mut scratch);
        self.pool.give(scratch);
        let out = self.push(Op::Gru { x, h0, w }, Shape::new(&[time, hidden, batch])?, needs, y)?;
        self.save(out, saved);
        Ok(out)
    }

    fn gru_weights(&self, w: GruVars) -> GruWeights<'_, T> {
        let [w_ih, w_hh, b_ih, b_hh] = w.operands().map(|v| self.value(v));
        GruWeights { w_ih, w_hh, b_ih, b_hh }
    }

    /// Determines the extents of a GRU layer from the shapes of its operands, and checks these.
    ///
    /// # Errors
    /// [`TensorError::BadShape`] or [`TensorError::ShapeMismatch`].
    pub(super) fn gru_dims(&self, x: Var, h0: Option<Var>, w: GruVars) -> Result<GruDims, TensorError> {
        let op = "gru_sequence";
        let sx = self.shape(x);
        let (time, input, batch) = sx.sequence(op)?;
        let [w_ih, w_hh, b_ih, b_hh] = w.operands().map(|v| self.shape(v));
        let fail = |left, right, rule| Err(TensorError::ShapeMismatch { op, left, right, rule });
        let &[rows, w_in] = w_ih.dims() else {
            return fail(sx, w_ih, "w_ih must be [3 hidden, input] for x [time, input, batch]");
        };
        if w_in != input || rows % 3 != 0 {
            return fail(sx, w_ih, "w_ih must be [3 hidden, input] for x [time, input, batch]");
        }
        let hidden = rows / 3;
        if w_hh.dims() != [rows, hidden] {
            return fail(w_ih, w_hh, "w_hh must be [3 hidden, hidden] for w_ih [3 hidden, input]");
        }
        for b in [b_ih, b_hh] {
            if b.dims() != [rows] {
                return fail(w_ih, b, "biases must be [3 hidden] for w_ih [3 hidden, input]");
            }
        }
        if let Some(h) = h0.map(|h| self.shape(h))
            && h.dims() != [hidden, batch]
        {
            return fail(sx, h, "h0 must be [hidden, batch] for x [time, input, batch]");
        }
        Ok(GruDims { time, input, hidden, batch })
    }
}

/// Number of first features of `x` whose gradient is needed.
///
/// Constants are often concatenated behind the differentiated features; their gradient is not computed.
fn differentiated_inputs<T: Scalar>(tape: &Tape<T>, x: Var, inputs: usize) -> usize {
    let Op::Concat { first, count, axis: 1 } = tape.op(x) else { return inputs };
    let (mut needed, mut end) = (0, 0);
    for &part in &tape.args[first..first + count] {
        end += tape.shape(part).dims()[1];
        if tape.needs_grad(&[part]) {
            needed = end;
        }
    }
    needed
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, x: Var, h0: Option<Var>, w: GruVars, out: Var, grad: &[T]) {
    let Ok(dims) = tape.gru_dims(x, h0, w) else { return };
    let mut scratch = tape.pool.take(T::gru_scratch(dims.input, dims.hidden));
    let (mut dx, dx_fresh) = tape.take_grad_to_write(x);
    let mut dh0 = h0.map_or(Default::default(), |h| tape.take_grad(h));
    let [mut dw_ih, mut dw_hh, mut db_ih, mut db_hh] = w.operands().map(|v| tape.take_grad_or_scratch(v));
    let args = GruBackward {
        dims,
        weights: tape.gru_weights(w),
        x: tape.value(x),
        h0: h0.map_or(&[], |h| tape.value(h)),
        y: tape.value(out),
        saved: tape.saved(out),
        dy: grad,
        dx: &mut dx,
        dx_fresh,
        dx_inputs: differentiated_inputs(tape, x, dims.input),
        dh0: &mut dh0,
        dw_ih: &mut dw_ih.0,
        dw_hh: &mut dw_hh.0,
        db_ih: &mut db_ih.0,
        db_hh: &mut db_hh.0,
    };
    T::gru_backward(args, &mut scratch);
    tape.pool.give(scratch);
    tape.put_grad(x, dx);
    if let Some(h) = h0 {
        tape.put_grad(h, dh0);
    }
    for (v, (grad, wanted)) in w.operands().into_iter().zip([dw_ih, dw_hh, db_ih, db_hh]) {
        tape.put_grad_or_scratch(v, grad, wanted);
    }
}
