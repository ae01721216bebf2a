//! Kullback-Leibler divergence between diagonal Gaussians, element by element.

use super::Op;
use super::elementwise::same_shape;
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records the Kullback-Leibler divergence KL(q
    /// p) of `q = N(mean_q, sd_q^2)`, `p = N(mean_p, sd_p^2)`.
    ///
    /// Element by element: `ln(sd_p / sd_q) + (sd_q^2 + (mean_q - mean_p)^2) / (2 sd_p^2) - 1/2`. The
    /// standard deviations must be positive.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let [m, s] = [tape.constant(&[1], &[1.0])?, tape.constant(&[1], &[2.0])?];
    /// let [zero, one] = [tape.constant(&[1], &[0.0])?, tape.constant(&[1], &[1.0])?];
    /// let y = tape.gaussian_kl((m, s), (zero, one))?;
    /// assert!((tape.value(y)[0] - (2.0 - 2f64.ln())).abs() < 1e-15); // ln(1/2) + (4 + 1) / 2 - 1/2
    /// let same = tape.gaussian_kl((m, s), (m, s))?;
    /// assert_eq!(tape.value(same), [0.0]);
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] unless the four shapes are equal.
    pub fn gaussian_kl(
        &mut self,
        (mean_q, sd_q): (Var, Var),
        (mean_p, sd_p): (Var, Var),
    ) -> Result<Var, TensorError> {
        let shape = self.shape(mean_q);
        for other in [sd_q, mean_p, sd_p] {
            same_shape("gaussian_kl", shape, self.shape(other))?;
        }
        let mut out = self.pool.take(shape.len());
        T::kl_forward([mean_q, sd_q, mean_p, sd_p].map(|v| self.value(v)), &mut out);
        let needs = self.needs_grad(&[mean_q, sd_q, mean_p, sd_p]);
        self.push(Op::GaussianKl { mean_q, sd_q, mean_p, sd_p }, shape, needs, out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, operands: [Var; 4], grad: &[T]) {
    let mut grads = operands.map(|v| tape.take_grad_or_scratch_to_write(v));
    let values = operands.map(|v| tape.value(v));
    let fresh = grads.each_ref().map(|(_, fresh, _)| *fresh);
    T::kl_backward(values, grad, grads.each_mut().map(|(g, ..)| &mut g[..]), fresh);
    for (v, (g, _, wanted)) in operands.into_iter().zip(grads) {
        tape.put_grad_or_scratch(v, g, wanted);
    }
}
