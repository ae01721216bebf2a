//! Affine layer, as `torch.nn.Linear`.

use crate::{Bound, Init, ParamId, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// An affine layer: `y = W x + b` over the feature axis, with W `[out, in]` and b `[out]`.
#[derive(Debug, Clone, Copy)]
pub struct Linear {
    pub(crate) weight: ParamId,
    pub(crate) bias: ParamId,
}

impl Linear {
    /// Registers the parameters `{prefix}.weight` and `{prefix}.bias` of an affine layer.
    ///
    /// Both are initialised uniformly within 1 / sqrt(inputs), as in PyTorch.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Linear, Params};
    /// let mut params = Params::<f32>::new(random_stream(1, "init", 0));
    /// Linear::new(&mut params, "fc", 4, 2);
    /// let names: Vec<&str> = params.iter().map(|(name, ..)| name).collect();
    /// assert_eq!(names, ["fc.weight", "fc.bias"]);
    /// assert!(params.values().iter().all(|v| v.abs() <= 0.5)); // 1 / sqrt(4)
    /// ```
    pub fn new<T: Scalar>(params: &mut Params<T>, prefix: &str, inputs: usize, outputs: usize) -> Self {
        let init = Init::Uniform { bound: 1.0 / (inputs as f64).sqrt() };
        Linear {
            weight: params.add(format!("{prefix}.weight"), &[outputs, inputs], init),
            bias: params.add(format!("{prefix}.bias"), &[outputs], init),
        }
    }

    /// Records the affine layer on the tape: maps `x [time, in, batch]` to `[time, out, batch]`.
    ///
    /// # Errors
    /// [`TensorError`] if `x` does not have the layer's number of inputs.
    pub fn forward<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, x: Var) -> Result<Var, TensorError> {
        tape.linear(x, p[self.weight], p[self.bias])
    }

    /// Records tanh of [`Linear::forward`] on the tape, computed in one pass.
    ///
    /// # Errors
    /// The errors of [`Linear::forward`].
    pub fn forward_tanh<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, x: Var) -> Result<Var, TensorError> {
        tape.linear_tanh(x, p[self.weight], p[self.bias])
    }
}
