//! Output layers that map features to a mixture of diagonal Gaussians.
//!
//! Source: Bishop, Mixture Density Networks, technical report, Aston University, 1994.

use crate::inference::{LinearRunner, SdRunner};
use crate::{Bound, Linear, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Output layer for a Gaussian mixture: affine layers for logits, means, and (softplus) standard deviations.
#[derive(Debug, Clone, Copy)]
pub struct MixtureHead {
    logits: Linear,
    mean: Linear,
    std: Linear,
    outputs: usize,
    components: usize,
    sd_floor: f64,
}

impl MixtureHead {
    /// Registers the parameters `{prefix}.logits`, `.mean` and `.std` for `[inputs, outputs, components]`.
    ///
    /// `sd_floor` is added to every standard deviation. The rows of component k begin at `k * outputs`.
    pub fn new<T: Scalar>(
        params: &mut Params<T>,
        prefix: &str,
        [inputs, outputs, components]: [usize; 3],
        sd_floor: f64,
    ) -> Self {
        MixtureHead {
            logits: Linear::new(params, &format!("{prefix}.logits"), inputs, components),
            mean: Linear::new(params, &format!("{prefix}.mean"), inputs, components * outputs),
            std: Linear::new(params, &format!("{prefix}.std"), inputs, components * outputs),
            outputs,
            components,
            sd_floor,
        }
    }

    /// Records the negative log-likelihood `[time, 1, batch]` of targets `x [time, out, batch]` given features `h`.
    ///
    /// `h` is `[time, in, batch]`. The constant `out ln(2 pi) / 2` is omitted.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Bound, MixtureHead, Params};
    /// use augsim_tensor::Tape;
    /// let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    /// let head = MixtureHead::new(&mut params, "mix", [1, 1, 2], 0.0);
    /// // Two standard Gaussians at -1 and 1 with equal weights: softplus(ln(e - 1)) = 1.
    /// let one = (1f64.exp() - 1.0).ln();
    /// params.values_mut().copy_from_slice(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, one, one]);
    /// let (mut tape, mut bound) = (Tape::new(), Bound::default());
    /// params.bind(&mut tape, &mut bound)?;
    /// let h = tape.constant(&[1, 1, 1], &[0.0])?;
    /// let x = tape.constant(&[1, 1, 1], &[0.0])?;
    /// let nll = head.nll(&mut tape, &bound, h, x)?;
    /// assert!((tape.value(nll)[0] - 0.5).abs() < 1e-12); // -ln(exp(-1/2))
    /// # Ok::<(), augsim_tensor::TensorError>(())
    /// ```
    ///
    /// # Errors
    /// [`TensorError`] if shapes are incompatible.
    pub fn nll<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, h: Var, x: Var) -> Result<Var, TensorError> {
        let logits = self.logits.forward(tape, p, h)?;
        let means = self.mean.forward(tape, p, h)?;
        let raw = self.std.forward(tape, p, h)?;
        let sd = tape.softplus(raw)?;
        let sds = tape.shift(sd, self.sd_floor)?;
        let mut log_densities = Vec::with_capacity(self.components);
        for k in 0..self.components {
            let range = (k * self.outputs, (k + 1) * self.outputs);
            let mean = tape.slice(means, 1, range.0, range.1)?;
            let sd = tape.slice(sds, 1, range.0, range.1)?;
            let nll = tape.gaussian_nll(x, mean, sd)?;
            let nll = tape.sum(nll, 1)?;
            let logit = tape.slice(logits, 1, k, k + 1)?;
            log_densities.push(tape.sub(logit, nll)?);
        }
        let joint = tape.concat(&log_densities, 1)?;
        let joint = log_sum_exp(tape, joint)?;
        let norm = log_sum_exp(tape, logits)?;
        tape.sub(norm, joint)
    }
}

/// Records ln of the sum of exponentials over the feature axis: `[time, F, batch]` to `[time, 1, batch]`.
///
/// The largest value is subtracted first and added at the end, as a constant. This changes neither the value
/// nor the gradient, and the exponentials stay finite.
fn log_sum_exp<T: Scalar>(tape: &mut Tape<T>, x: Var) -> Result<Var, TensorError> {
    let dims = [tape.shape(x).dims()[0], tape.shape(x).dims()[1], tape.shape(x).dims()[2]];
    let [time, features, batch] = dims;
    let mut largest = vec![T::ZERO; time * batch];
    let values = tape.value(x);
    for (t, out) in largest.chunks_exact_mut(batch.max(1)).enumerate() {
        for (lane, out) in out.iter_mut().enumerate() {
            let column = (0..features).map(|k| values[(t * features + k) * batch + lane]);
            *out = column.fold(T::from_f64(f64::MIN), |m, v| if v > m { v } else { m });
        }
    }
    let largest = tape.constant(&[time, 1, batch], &largest)?;
    let lowered = tape.sub(x, largest)?;
    let exp = tape.exp(lowered)?;
    let sum = tape.sum(exp, 1)?;
    let ln = tape.ln(sum)?;
    tape.add(ln, largest)
}

/// A [`MixtureHead`] without a tape, which draws one mixture component for each lane.
#[derive(Debug, Clone)]
pub struct MixtureRunner {
    logits: LinearRunner,
    mean: LinearRunner,
    sd: SdRunner,
    /// Means and standard deviations of the components that were drawn, `[out, lane]` each.
    drawn: [Vec<f32>; 2],
    outputs: usize,
    components: usize,
    lanes: usize,
}

impl MixtureRunner {
    /// Copies the weights of `head`, for `lanes` sequences and one step at a time.
    pub fn new(head: &MixtureHead, params: &Params<f32>, lanes: usize) -> Self {
        let MixtureHead { outputs, components, .. } = *head;
        MixtureRunner {
            logits: LinearRunner::new(head.logits, params, lanes, 1),
            mean: LinearRunner::new(head.mean, params, lanes, 1),
            sd: SdRunner::new(head.std, head.sd_floor, params, lanes, 1),
            drawn: [0, 1].map(|_| vec![0.0; outputs * lanes]),
            outputs,
            components,
            lanes,
        }
    }

    /// Draws a mixture component for each lane; returns its mean and standard deviation, `[out, lane]` each.
    ///
    /// `h [in, lane]` are the features, `uniform [lane]` random numbers in `[0, 1)`.
    pub fn choose(&mut self, h: &[f32], uniform: &[f32]) -> (&[f32], &[f32]) {
        let logits = &*self.logits.run(h, 1);
        let (mean, sd) = (&*self.mean.run(h, 1), self.sd.run(h, 1));
        let lanes = self.lanes;
        for (lane, uniform) in uniform.iter().enumerate() {
            let logit = |k: usize| logits[k * lanes + lane];
            let largest = (0..self.components).map(logit).fold(f32::MIN, f32::max);
            let weight = |k: usize| (logit(k) - largest).exp();
            // Inverse of the cumulative distribution: subtract weights until less than the next one remains.
            let mut remaining = uniform * (0..self.components).map(weight).sum::<f32>();
            let mut k = 0;
            while k + 1 < self.components && remaining >= weight(k) {
                remaining -= weight(k);
                k += 1;
            }
            for j in 0..self.outputs {
                let row = (k * self.outputs + j) * lanes + lane;
                self.drawn[0][j * lanes + lane] = mean[row];
                self.drawn[1][j * lanes + lane] = sd[row];
            }
        }
        (&self.drawn[0], &self.drawn[1])
    }
}
