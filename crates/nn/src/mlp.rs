//! Multi-layer perceptron with tanh after every layer.

use crate::{Bound, Linear, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// A multi-layer perceptron: affine layers, each followed by tanh; without layers it is the identity.
#[derive(Debug, Clone, Default)]
pub struct Mlp {
    pub(crate) layers: Vec<Linear>,
}

impl Mlp {
    /// Registers the parameters of the layers `{prefix}.0`, `{prefix}.2`, …
    ///
    /// These are the names of a `torch.nn.Sequential` in which every other module is tanh. `widths` holds the
    /// number of inputs, then the number of outputs of each layer.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Mlp, Params};
    /// let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    /// Mlp::new(&mut params, "phi", &[3, 32, 16]);
    /// let shapes: Vec<(&str, &[usize])> = params.iter().map(|(name, dims, _)| (name, dims)).collect();
    /// assert_eq!(shapes[0], ("phi.0.weight", &[32, 3][..]));
    /// assert_eq!(shapes[2], ("phi.2.weight", &[16, 32][..]));
    /// ```
    pub fn new<T: Scalar>(params: &mut Params<T>, prefix: &str, widths: &[usize]) -> Self {
        let layers = widths
            .windows(2)
            .enumerate()
            .map(|(i, w)| Linear::new(params, &format!("{prefix}.{}", 2 * i), w[0], w[1]))
            .collect();
        Mlp { layers }
    }

    /// Records the perceptron on the tape: maps `x [time, in, batch]` to `[time, out, batch]`.
    ///
    /// # Errors
    /// [`TensorError`] if `x` does not have the first layer's number of inputs.
    pub fn forward<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, x: Var) -> Result<Var, TensorError> {
        let mut out = x;
        for layer in &self.layers {
            out = layer.forward_tanh(tape, p, out)?;
        }
        Ok(out)
    }
}
