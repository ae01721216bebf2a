//! A net in a page: a GRU that reads a sequence, and a Gaussian head that says what comes next and how sure it is.

use augsim_nn::{Adam, AdamState, Bound, GaussianHead, Gru, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Extents: one feature in, one out.
pub const HIDDEN: usize = 8;

/// The net: layers hold the ids of their parameters and nothing else.
pub struct TinyNet {
    memory: Gru,
    head: GaussianHead,
}

impl TinyNet {
    /// Registers the parameters `memory.*`, `head.*` under PyTorch's names.
    pub fn new<T: Scalar>(params: &mut Params<T>) -> Self {
        let memory = Gru::new(params, "memory", 1, HIDDEN, 1);
        // The floor keeps 1 / sd finite in single precision.
        let head = GaussianHead::new(params, "head", HIDDEN, 1, 1e-2);
        TinyNet { memory, head }
    }

    /// Negative log-likelihood, less constants, of `next [time, 1, lanes]` given `seen [time, 1, lanes]`: a sum over all.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
    pub fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        seen: Var,
        next: Var,
    ) -> Result<Var, TensorError> {
        let state = self.memory.forward(tape, p, seen, &[])?;
        let law = self.head.forward(tape, p, state)?;
        let misfit = tape.gaussian_nll(next, law.mean, law.sd)?;
        tape.sum_all(misfit)
    }
}

/// Trains on sequences of equal length, `[time, lanes]` each; returns the loss before every step.
///
/// # Errors
/// [`TensorError`] if the extents do not fit.
pub fn train<T: Scalar>(
    net: &TinyNet,
    params: &mut Params<T>,
    (time, lanes): (usize, usize),
    (seen, next): (&[T], &[T]),
    steps: usize,
) -> Result<Vec<f64>, TensorError> {
    // One tape for the whole run: after the first step nothing is allocated.
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    let (adam, mut state) = (Adam::default(), AdamState::new(params.values().len()));
    let mut grads = vec![T::ZERO; params.values().len()];
    let mut losses = Vec::with_capacity(steps);
    for _ in 0..steps {
        tape.reset();
        params.bind(&mut tape, &mut bound)?;
        let x = tape.constant(&[time, 1, lanes], seen)?;
        let y = tape.constant(&[time, 1, lanes], next)?;
        let loss = net.loss(&mut tape, &bound, x, y)?;
        tape.backward(loss)?;
        params.gather_grads(&tape, &bound, &mut grads);
        losses.push(tape.value(loss)[0].to_f64());
        adam.step(&mut state, params.values_mut(), &grads, 0.02);
    }
    Ok(losses)
}
