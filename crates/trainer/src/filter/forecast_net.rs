//! The net of [`super::ForecastCorrection`]: a GRU over the rows of a forecast with a Student's t loss.
//!
//! For target x, location m and scale s, with n degrees of freedom, the loss of one value is
//!
//! ```text
//! (1)  (n + 1) / 2 ln(1 + (x - m)^2 / (n s^2)) + ln s
//! ```
//!
//! up to a constant (Lange, Little and Taylor 1989).

use crate::league::{Extents, operands, zero};
use crate::nets::tile::{LossVars, Losses, Tile, backpropagate, masked_sum};
use crate::tiles::Trainable;
use augsim_nn::inference::{GaussianRunner, GruRunner};
use augsim_nn::{Bound, GaussianHead, Gru, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Number of hidden units of the GRU.
const HIDDEN_WIDTH: usize = 16;
/// Degrees of freedom of the Student's t distribution in the loss.
/// About one trajectory in ten has a very large error. The heavy tails keep it from dominating the fit.
const DEGREES_OF_FREEDOM: f64 = 2.0;
/// Minimum scale of the Student's t distribution, in the units of the corrections.
const MIN_SCALE: f64 = 1e-2;

/// Net that maps U features per row to location and scale of the corrections of S columns.
#[derive(Debug, Clone)]
pub(super) struct ForecastNet {
    extents: Extents,
    gru: Gru,
    head: GaussianHead,
}

impl ForecastNet {
    /// Creates the net and registers its parameters.
    pub fn new<T: Scalar>(extents: Extents, params: &mut Params<T>) -> Self {
        ForecastNet {
            extents,
            gru: Gru::new(params, "memory", extents.condition, HIDDEN_WIDTH, 1),
            head: GaussianHead::new(params, "row", HIDDEN_WIDTH, extents.state, MIN_SCALE),
        }
    }

    /// Records the loss of a batch tile: the sum of formula (1) over the unmasked values.
    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let (target, features, mask) = operands(tape, &tile, self.extents)?;
        let hidden = self.gru.forward(tape, p, features, &[])?;
        let distribution = self.head.forward(tape, p, hidden)?;
        let nll = student_nll(tape, target, distribution.mean, distribution.sd)?;
        let nll = masked_sum(tape, nll, mask)?;
        Ok(LossVars { total: nll, kl: zero(tape)?, negative_ln_likelihood: nll })
    }

    /// Computes location and scale `[time, S]` of the corrections for features `u [time, U]`.
    pub fn predict(&self, params: &Params<f32>, u: &[f32]) -> [Vec<f32>; 2] {
        let time = u.len() / self.extents.condition;
        let mut runner = GruRunner::new(&self.gru, params, 1, time);
        let mut head = GaussianRunner::new(self.head, params, 1, time);
        let (location, scale) = head.run(runner.run(u, time), time);
        [location.to_vec(), scale.to_vec()]
    }
}

fn student_nll<T: Scalar>(
    tape: &mut Tape<T>,
    target: Var,
    location: Var,
    scale: Var,
) -> Result<Var, TensorError> {
    let deviation = tape.sub(target, location)?;
    let z = tape.div(deviation, scale)?;
    let scaled_square = tape.mul(z, z)?;
    let scaled_square = tape.scale(scaled_square, DEGREES_OF_FREEDOM.recip())?;
    let scaled_square = tape.shift(scaled_square, 1.0)?;
    let tail = tape.ln(scaled_square)?;
    let tail = tape.scale(tail, 0.5 * (DEGREES_OF_FREEDOM + 1.0))?;
    let log_scale = tape.ln(scale)?;
    tape.add(tail, log_scale)
}

impl Trainable for ForecastNet {
    fn noise_rows(&self, _: usize) -> (usize, usize) {
        (0, 0)
    }

    fn differentiate(
        &self,
        tape: &mut Tape<f32>,
        p: &Bound,
        tile: Tile<'_, f32>,
        scale: f64,
    ) -> Result<Losses<f32>, TensorError> {
        let loss = self.loss(tape, p, tile)?;
        backpropagate(tape, loss, scale)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the loss is that of Student's t, and its gradient agrees with central differences.
    use super::*;
    use augsim_data::random_stream;

    const SIZES: [usize; 4] = [3, 2, 4, 2]; // rows, columns, features, lanes

    fn standard_normals(purpose: &str, n: usize) -> Vec<f64> {
        crate::noise::standard(5, purpose, 0, n).into_iter().map(f64::from).collect()
    }

    fn loss(net: &ForecastNet, params: &Params<f64>, mask: &[f64]) -> (f64, Vec<f64>) {
        let [time, columns, features, lanes] = SIZES;
        let (x, u) =
            (standard_normals("x", time * columns * lanes), standard_normals("u", time * features * lanes));
        let (mut tape, mut bound) = (Tape::new(), Bound::default());
        params.bind(&mut tape, &mut bound).unwrap();
        let tile = Tile { time, lanes, x: &x, u: &u, eps: &[], mask };
        let vars = net.loss(&mut tape, &bound, tile).unwrap();
        let total = tape.value(vars.total)[0];
        tape.backward(vars.total).unwrap();
        let mut grads = vec![0.0; params.values().len()];
        params.gather_grads(&tape, &bound, &mut grads);
        (total, grads)
    }

    #[test]
    fn gradient_agrees_with_central_differences() {
        let [_, columns, features, _] = SIZES;
        let mut params = Params::<f64>::new(random_stream(1, "init", 0));
        let net = ForecastNet::new(Extents { state: columns, condition: features }, &mut params);
        // The second lane is one row shorter than the first.
        let mask = [1.0, 1.0, 1.0, 1.0, 1.0, 0.0];
        let (_, gradient) = loss(&net, &params, &mask);
        let direction = standard_normals("direction", params.values().len());
        let step = 1e-6;
        let [above, below] = [step, -step].map(|h| {
            let mut moved = params.clone();
            moved.values_mut().iter_mut().zip(&direction).for_each(|(p, v)| *p += h * v);
            loss(&net, &moved, &mask).0
        });
        let along: f64 = gradient.iter().zip(&direction).map(|(g, v)| g * v).sum();
        let difference = (above - below) / (2.0 * step);
        assert!(
            (along - difference).abs() < 1e-7 * difference.abs().max(1.0),
            "{along} against {difference}"
        );
    }

    #[test]
    fn loss_is_students_t_with_two_degrees_of_freedom() {
        let mut tape = Tape::<f64>::new();
        let [x, location, scale] = [1.7, 0.2, 0.5].map(|v| tape.constant(&[1, 1, 1], &[v]).unwrap());
        let loss = student_nll(&mut tape, x, location, scale).unwrap();
        // The density of t with two degrees of freedom is (2 + z^2)^(-3/2) (Abramowitz and Stegun 26.7).
        let z: f64 = (1.7 - 0.2) / 0.5;
        let expected = -((2.0 + z * z).powf(-1.5) / 0.5).ln() - 1.5 * 2.0_f64.ln();
        assert!((tape.value(loss)[0] - expected).abs() < 1e-12);
    }
}
