//! Half the squared difference, element by element.
//!
//! It is the negative log-likelihood of a Gaussian with standard deviation 1, without the constant ln(2 pi) /
//! 2.

use super::Op;
use super::elementwise::{same_shape, vectorised};
use crate::{Scalar, Tape, TensorError, Var};

impl<T: Scalar> Tape<T> {
    /// Records half the squared difference, `(x - mean)^2 / 2`, element by element.
    ///
    /// ```
    /// # use augsim_tensor::Tape;
    /// # let mut tape = Tape::<f64>::new();
    /// let x = tape.constant(&[2], &[3.0, 0.0])?;
    /// let mean = tape.variable(&[2], &[1.0, 0.0])?;
    /// let y = tape.squared_error(x, mean)?;
    /// let loss = tape.sum_all(y)?;
    /// tape.backward(loss)?;
    /// assert_eq!((tape.value(y), tape.grad(mean)), (&[2.0, 0.0][..], &[-2.0, 0.0][..]));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError::ShapeMismatch`] unless the shapes are equal.
    pub fn squared_error(&mut self, x: Var, mean: Var) -> Result<Var, TensorError> {
        same_shape("squared_error", self.shape(x), self.shape(mean))?;
        let half = T::from_f64(0.5);
        self.zip(Op::SquaredError, x, mean, |x, m| half * (x - m) * (x - m))
    }
}

pub(super) fn vjp<T: Scalar>(tape: &mut Tape<T>, x: Var, mean: Var, grad: &[T]) {
    for (operand, sign) in [(x, T::ONE), (mean, -T::ONE)] {
        tape.contribute(operand, |d, fresh, tape| {
            let (x, m) = (tape.value(x), tape.value(mean));
            vectorised(|| {
                for (((d, g), x), m) in d.iter_mut().zip(grad).zip(x).zip(m) {
                    let slope = sign * *g * (*x - *m);
                    *d = if fresh { slope } else { *d + slope };
                }
            });
        });
    }
}
