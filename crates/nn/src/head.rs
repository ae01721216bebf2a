//! Output layers that map features to a diagonal Gaussian.

use crate::{Bound, Linear, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Mean and standard deviation of a diagonal Gaussian, both `[time, feature, batch]`.
#[derive(Debug, Clone, Copy)]
pub struct Gaussian {
    /// Mean of the Gaussian.
    pub mean: Var,
    /// Standard deviation of the Gaussian, positive.
    pub sd: Var,
}

/// A Gaussian output layer: an affine layer for the mean, another with softplus for the standard deviation.
#[derive(Debug, Clone, Copy)]
pub struct GaussianHead {
    pub(crate) mean: Linear,
    pub(crate) std: Linear,
    pub(crate) sd_floor: f64,
}

impl GaussianHead {
    /// Registers the parameters `{prefix}.mean` and `{prefix}.std` of the two layers.
    ///
    /// `sd_floor` is added to the standard deviation; it keeps 1 / sd finite in single precision.
    pub fn new<T: Scalar>(
        params: &mut Params<T>,
        prefix: &str,
        inputs: usize,
        outputs: usize,
        sd_floor: f64,
    ) -> Self {
        GaussianHead {
            mean: Linear::new(params, &format!("{prefix}.mean"), inputs, outputs),
            std: Linear::new(params, &format!("{prefix}.std"), inputs, outputs),
            sd_floor,
        }
    }

    /// Records mean and standard deviation for features `x [time, in, batch]`.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Bound, GaussianHead, Params};
    /// use augsim_tensor::Tape;
    /// let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    /// let head = GaussianHead::new(&mut params, "head", 3, 2, 0.01);
    /// let (mut tape, mut bound) = (Tape::new(), Bound::default());
    /// params.bind(&mut tape, &mut bound)?;
    /// let x = tape.constant(&[4, 3, 1], &[-50.0; 12])?;
    /// let law = head.forward(&mut tape, &bound, x)?;
    /// assert_eq!(tape.shape(law.mean).dims(), [4, 2, 1]);
    /// assert!(tape.value(law.sd).iter().all(|sd| *sd >= 0.01));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError`] if `x` does not have the head's number of inputs.
    pub fn forward<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, x: Var) -> Result<Gaussian, TensorError> {
        let mean = self.mean.forward(tape, p, x)?;
        let raw = self.std.forward(tape, p, x)?;
        // Softplus grows linearly; an exponential would overflow in single precision from 89.
        let mut sd = tape.softplus(raw)?;
        if self.sd_floor > 0.0 {
            sd = tape.shift(sd, self.sd_floor)?;
        }
        Ok(Gaussian { mean, sd })
    }
}
