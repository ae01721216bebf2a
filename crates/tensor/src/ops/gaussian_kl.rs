//! Kullback-Leibler divergence between diagonal Gaussians, element by element (paper, section III).

use super::Op;
use super::elementwise::{same_shape, vectorised};
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// KL(q || p) of `q = N(mean_q, sd_q^2)` from `p = N(mean_p, sd_p^2)`, element by element:
    /// `ln(sd_p / sd_q) + (sd_q^2 + (mean_q - mean_p)^2) / (2 sd_p^2) - 1/2`. Deviations must be positive.
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
        let [mq, sq, mp, sp] = [mean_q, sd_q, mean_p, sd_p].map(|v| self.value(v));
        let half = T::of(0.5);
        for ((((o, mq), sq), mp), sp) in out.iter_mut().zip(mq).zip(sq).zip(mp).zip(sp) {
            let (ratio, shift) = (*sq / *sp, (*mq - *mp) / *sp);
            *o = half * (ratio * ratio + shift * shift) - half - ratio.ln();
        }
        let needs = self.needs_grad(&[mean_q, sd_q, mean_p, sd_p]);
        self.push(Op::GaussianKl { mean_q, sd_q, mean_p, sd_p }, shape, needs, out)
    }
}

/// Derivative of the divergence with respect to one operand at `(mean_q, sd_q, mean_p, sd_p)`.
type Slope<T> = fn(T, T, T, T) -> T;

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, operands: [Var; 4], grad: &[T]) {
    let slopes: [Slope<T>; 4] = [
        |mq, _, mp, sp| (mq - mp) / (sp * sp),
        |_, sq, _, sp| sq / (sp * sp) - T::ONE / sq,
        |mq, _, mp, sp| (mp - mq) / (sp * sp),
        |mq, sq, mp, sp| {
            let inv = T::ONE / sp;
            inv - inv * inv * inv * (sq * sq + (mq - mp) * (mq - mp))
        },
    ];
    for (of, slope) in operands.into_iter().zip(slopes) {
        tape.accumulate(of, |d, tape| {
            let [mq, sq, mp, sp] = operands.map(|v| tape.value(v));
            vectorised(|| {
                for (((((d, g), mq), sq), mp), sp) in d.iter_mut().zip(grad).zip(mq).zip(sq).zip(mp).zip(sp) {
                    *d += *g * slope(*mq, *sq, *mp, *sp);
                }
            });
        });
    }
}
