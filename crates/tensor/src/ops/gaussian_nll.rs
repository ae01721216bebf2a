//! Negative log-likelihood of a Gaussian with its own standard deviation, element by element, less the
//! constant ln(2 pi) / 2.

use super::Op;
use super::elementwise::{same_shape, vectorised};
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// `ln sd + (x - mean)^2 / (2 sd^2)`, element by element. `sd` must be positive.
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] unless the three shapes are equal.
    pub fn gaussian_nll(&mut self, x: Var, mean: Var, sd: Var) -> Result<Var, TensorError> {
        let shape = self.shape(x);
        same_shape("gaussian_nll", shape, self.shape(mean))?;
        same_shape("gaussian_nll", shape, self.shape(sd))?;
        let mut out = self.pool.take(shape.len());
        let (xs, ms, ss) = (self.value(x), self.value(mean), self.value(sd));
        let half = T::of(0.5);
        for (((o, x), m), s) in out.iter_mut().zip(xs).zip(ms).zip(ss) {
            let d = (*x - *m) / *s;
            *o = s.ln() + half * d * d;
        }
        self.push(Op::GaussianNll { x, mean, sd }, shape, self.needs_grad(&[x, mean, sd]), out)
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, x: Var, mean: Var, sd: Var, grad: &[T]) {
    for (of, sign) in [(x, T::ONE), (mean, -T::ONE)] {
        tape.accumulate(of, |d, tape| {
            let (x, m, s) = (tape.value(x), tape.value(mean), tape.value(sd));
            vectorised(|| {
                for ((((d, g), x), m), s) in d.iter_mut().zip(grad).zip(x).zip(m).zip(s) {
                    *d += sign * *g * (*x - *m) / (*s * *s);
                }
            });
        });
    }
    tape.accumulate(sd, |d, tape| {
        let (x, m, s) = (tape.value(x), tape.value(mean), tape.value(sd));
        vectorised(|| {
            for ((((d, g), x), m), s) in d.iter_mut().zip(grad).zip(x).zip(m).zip(s) {
                let e = (*x - *m) / *s;
                *d += *g * (T::ONE - e * e) / *s;
            }
        });
    });
}
