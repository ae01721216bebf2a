//! Multi-layer GRU (gated recurrent unit), as `torch.nn.GRU`.

use crate::{Bound, Init, ParamId, Params};
use augsim_tensor::{GruVars, Scalar, Tape, TensorError, Var};

/// Identifiers of the parameters of one GRU layer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layer {
    pub w_ih: ParamId,
    pub w_hh: ParamId,
    pub b_ih: ParamId,
    pub b_hh: ParamId,
}

/// A stack of GRU layers; the inputs of each layer are the hidden states of the layer below.
#[derive(Debug, Clone)]
pub struct Gru {
    pub(crate) layers: Vec<Layer>,
}

impl Gru {
    /// Registers the parameters `{prefix}.weight_ih_l0` and so on, under PyTorch's names.
    ///
    /// All are initialised uniformly within 1 / sqrt(hidden), as in PyTorch.
    pub fn new<T: Scalar>(
        params: &mut Params<T>,
        prefix: &str,
        inputs: usize,
        hidden: usize,
        layers: usize,
    ) -> Self {
        let init = Init::Uniform { bound: 1.0 / (hidden as f64).sqrt() };
        let rows = 3 * hidden;
        let layers = (0..layers)
            .map(|l| {
                let width = if l == 0 { inputs } else { hidden };
                Layer {
                    w_ih: params.add(format!("{prefix}.weight_ih_l{l}"), &[rows, width], init),
                    w_hh: params.add(format!("{prefix}.weight_hh_l{l}"), &[rows, hidden], init),
                    b_ih: params.add(format!("{prefix}.bias_ih_l{l}"), &[rows], init),
                    b_hh: params.add(format!("{prefix}.bias_hh_l{l}"), &[rows], init),
                }
            })
            .collect();
        Gru { layers }
    }

    /// Records the hidden states of the last layer, `[time, hidden, batch]`, for inputs `x [time, in, batch]`.
    ///
    /// `h0` holds one initial state `[hidden, batch]` per layer, or is empty for states of 0.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Bound, Gru, Params};
    /// use augsim_tensor::Tape;
    /// let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    /// let gru = Gru::new(&mut params, "gru", 3, 5, 2);
    /// let (mut tape, mut bound) = (Tape::new(), Bound::default());
    /// params.bind(&mut tape, &mut bound)?;
    /// let x = tape.constant(&[7, 3, 2], &[0.1; 42])?; // 7 steps, 3 features, 2 sequences
    /// let h = gru.forward(&mut tape, &bound, x, &[])?;
    /// assert_eq!(tape.shape(h).dims(), [7, 5, 2]);
    /// assert!(tape.value(h).iter().all(|h| h.abs() < 1.0));
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError`] if shapes are incompatible.
    pub fn forward<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        x: Var,
        h0: &[Var],
    ) -> Result<Var, TensorError> {
        self.forward_layers(tape, p, x, h0, |_| ())
    }

    /// Runs [`Gru::forward`] and passes the hidden states of each layer, from the lowest, to `on_layer`.
    ///
    /// The states are `[time, hidden, batch]`; those of their last steps are `h_n` of PyTorch.
    ///
    /// # Errors
    /// The errors of [`Gru::forward`].
    pub fn forward_layers<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        x: Var,
        h0: &[Var],
        mut on_layer: impl FnMut(Var),
    ) -> Result<Var, TensorError> {
        let mut out = x;
        for (i, l) in self.layers.iter().enumerate() {
            let w = GruVars { w_ih: p[l.w_ih], w_hh: p[l.w_hh], b_ih: p[l.b_ih], b_hh: p[l.b_hh] };
            out = tape.gru_sequence(out, h0.get(i).copied(), w)?;
            on_layer(out);
        }
        Ok(out)
    }
}
