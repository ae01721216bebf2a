//! Negative log-likelihood of a Gaussian, element by element, without the constant ln(2 pi) / 2.

use super::Op;
use super::elementwise::same_shape;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records `ln sd + (x - mean)^2 / (2 sd^2)`, element by element. `sd` must be positive.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let x = tape.constant(&[1], &[3.0])?;
    /// let mean = tape.variable(&[1], &[1.0])?;
    /// let sd = tape.constant(&[1], &[2.0])?;
    /// let y = tape.gaussian_nll(x, mean, sd)?;
    /// tape.backward(y)?;
    /// assert_eq!(tape.value(y), [2f64.ln() + 0.5]);
    /// assert_eq!(tape.grad(mean), [-0.5]); // (mean - x) / sd²
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] unless the three shapes are equal.
    pub fn gaussian_nll(&mut self, x: Var, mean: Var, sd: Var) -> Result<Var, TensorError> {
        let shape = self.shape(x);
        same_shape("gaussian_nll", shape, self.shape(mean))?;
        same_shape("gaussian_nll", shape, self.shape(sd))?;
        let mut out = self.pool.take(shape.len());
        T::nll_forward([x, mean, sd].map(|v| self.value(v)), &mut out);
        self.push(Op::GaussianNll { x, mean, sd }, shape, self.needs_grad(&[x, mean, sd]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, x: Var, mean: Var, sd: Var, grad: &[T]) {
    let operands = [x, mean, sd];
    let mut grads = operands.map(|v| tape.take_grad_or_scratch_to_write(v));
    let values = operands.map(|v| tape.value(v));
    let fresh = grads.each_ref().map(|(_, fresh, _)| *fresh);
    T::nll_backward(values, grad, grads.each_mut().map(|(g, ..)| &mut g[..]), fresh);
    for (v, (g, _, wanted)) in operands.into_iter().zip(grads) {
        tape.put_grad_or_scratch(v, g, wanted);
    }
}
