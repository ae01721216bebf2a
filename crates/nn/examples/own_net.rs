//! A small network: a GRU reads a sequence, and a Gaussian head predicts the next value.
//!
//! `cargo run --release -p augsim-nn --example own_net` trains it on noisy oscillations.

use augsim_data::random_stream;
use augsim_nn::{Adam, AdamState, Bound, GaussianHead, Gru, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};
use rand_distr::{Distribution, StandardNormal};

/// Number of hidden units of the GRU.
pub const HIDDEN: usize = 8;

/// The network: a GRU and a Gaussian head, which hold only the identifiers of their parameters.
pub struct TinyNet {
    memory: Gru,
    head: GaussianHead,
}

impl TinyNet {
    /// Registers the parameters `memory.*` and `head.*`, with PyTorch's names.
    pub fn new<T: Scalar>(params: &mut Params<T>) -> Self {
        let memory = Gru::new(params, "memory", 1, HIDDEN, 1);
        // The floor keeps 1 / sd finite in single precision.
        let head = GaussianHead::new(params, "head", HIDDEN, 1, 1e-2);
        TinyNet { memory, head }
    }

    /// Records the summed negative log-likelihood of `next` given `inputs`, `[time, 1, lanes]` each, without
    /// constants.
    ///
    /// # Errors
    /// [`TensorError`] if shapes are incompatible.
    pub fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        inputs: Var,
        next: Var,
    ) -> Result<Var, TensorError> {
        let state = self.memory.forward(tape, p, inputs, &[])?;
        let predicted = self.head.forward(tape, p, state)?;
        let nll = tape.gaussian_nll(next, predicted.mean, predicted.sd)?;
        tape.sum_all(nll)
    }
}

/// Trains the network on sequences of equal length, `[time, lanes]` each; returns the loss before every step.
///
/// # Errors
/// [`TensorError`] if shapes are incompatible.
pub fn train<T: Scalar>(
    net: &TinyNet,
    params: &mut Params<T>,
    (time, lanes): (usize, usize),
    (inputs, next): (&[T], &[T]),
    steps: usize,
) -> Result<Vec<f64>, TensorError> {
    // The tape is reused for all steps: after the first step nothing is allocated.
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    let (adam, mut state) = (Adam::default(), AdamState::new(params.values().len()));
    let mut grads = vec![T::ZERO; params.values().len()];
    let mut losses = Vec::with_capacity(steps);
    for _ in 0..steps {
        tape.reset();
        params.bind(&mut tape, &mut bound)?;
        let x = tape.constant(&[time, 1, lanes], inputs)?;
        let y = tape.constant(&[time, 1, lanes], next)?;
        let loss = net.loss(&mut tape, &bound, x, y)?;
        tape.backward(loss)?;
        params.gather_grads(&tape, &bound, &mut grads);
        losses.push(tape.value(loss)[0].to_f64());
        adam.step(&mut state, params.values_mut(), &grads, 0.02);
    }
    Ok(losses)
}

/// Generates oscillations with noise of standard deviation 0.1, `[time, lanes]`, and the values one step later.
pub fn oscillations(seed: u64, time: usize, lanes: usize) -> (Vec<f64>, Vec<f64>) {
    let mut random = random_stream(seed, "oscillations", 0);
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    let mut rows: Vec<f64> = Vec::with_capacity((time + 1) * lanes);
    for t in 0..=time {
        rows.extend(
            (0..lanes).map(|lane| (0.7 * t as f64 + lane as f64 + seed as f64).sin() + 0.1 * noise()),
        );
    }
    (rows[..time * lanes].to_vec(), rows[lanes..].to_vec())
}

/// Trains the network and prints the loss per value, in nats, without the constant ln(2 pi) / 2.
#[expect(clippy::print_stdout, reason = "an example prints its results")]
pub fn main() -> Result<(), TensorError> {
    let (time, lanes) = (30, 16);
    let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    let net = TinyNet::new(&mut params);
    let (inputs, next) = oscillations(1, time, lanes);
    let losses = train(&net, &mut params, (time, lanes), (&inputs, &next), 300)?;
    for (step, loss) in losses.iter().enumerate().step_by(60) {
        println!("step {step}: {:.3} nats", loss / (time * lanes) as f64);
    }
    Ok(())
}
