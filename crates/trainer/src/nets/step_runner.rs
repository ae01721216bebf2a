//! Decoder of Hybrid+ without a tape: corrections of single physics steps, many at once.

use super::Stepwise;
use augsim_nn::Params;
use augsim_nn::inference::{GaussianRunner, LinearRunner, MlpRunner};

/// Runs the decoder of a [`Stepwise`] net without memory on a batch of steps, one per lane.
///
/// Nothing is allocated after construction.
#[derive(Debug, Clone)]
pub struct StepRunner {
    step: MlpRunner,
    head: GaussianRunner,
    /// Layer that maps the latent to shifts of physics parameters; `None` without such parameters.
    shifts: Option<LinearRunner>,
    mean: Vec<f32>,
    /// Inputs of the decoder: features `[U, lane]`, then latents `[L, lane]`.
    input: Vec<f32>,
    condition: usize,
    lanes: usize,
}

impl StepRunner {
    /// Creates a runner of the decoder of `net`, for `lanes` physics steps at once.
    pub fn new(net: &Stepwise, params: &Params<f32>, lanes: usize) -> Self {
        let sizes = net.sizes();
        let (step, head, shifts) = net.decoder();
        StepRunner {
            step: MlpRunner::new(step, params, lanes, 1),
            head: GaussianRunner::new(head, params, lanes, 1),
            shifts: shifts.map(|layer| LinearRunner::new(layer, params, lanes, 1)),
            mean: vec![0.0; sizes.state * lanes],
            input: vec![0.0; (sizes.condition + sizes.latent) * lanes],
            condition: sizes.condition,
            lanes,
        }
    }

    /// Number of lanes: physics steps that one call corrects.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Input buffers: fill features `[U, lane]` and latents `[L, lane]` before [`run`](Self::run).
    pub fn input(&mut self) -> (&mut [f32], &mut [f32]) {
        self.input.split_at_mut(self.condition * self.lanes)
    }

    /// Computes mean and standard deviation `[S, lane]` of the corrections for the [`input`](Self::input).
    pub fn run(&mut self) -> (&[f32], &[f32]) {
        let (features, w) = self.input.split_at(self.condition * self.lanes);
        let (mean, sd) = self.head.run(self.step.run(&self.input, 1), 1);
        self.mean.copy_from_slice(mean);
        if let Some(layer) = &mut self.shifts {
            let shifts = layer.run(w, 1);
            // The sensitivities `[P, S, lane]` of the step to the physics parameters are the last features.
            let changes = &features[features.len() - self.mean.len() * shifts.len() / self.lanes..];
            for (changes, shift) in changes.chunks_exact(self.mean.len()).zip(shifts.chunks_exact(self.lanes))
            {
                let products = changes.iter().zip(shift.iter().cycle());
                self.mean
                    .iter_mut()
                    .zip(products)
                    .for_each(|(mean, (change, shift))| *mean += change * shift);
            }
        }
        (&self.mean, sd)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the runner agrees with the tape, with and without shifted physics parameters.
    use super::*;
    use crate::nets::StepwiseSizes;
    use augsim_data::random_stream;
    use augsim_nn::Bound;
    use augsim_tensor::Tape;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_runner_agrees_with_the_tape() {
        let lanes = 5;
        for physics_parameters in [0, 1, 2] {
            let sizes = StepwiseSizes {
                state: 2,
                condition: 10 + 2 * physics_parameters,
                latent: 3,
                hidden: 8,
                sd_floor: 1e-2,
                physics_parameters,
            };
            let mut params = Params::<f32>::new(random_stream(1, "init", physics_parameters as u64));
            let net = Stepwise::new(&mut params, sizes);
            let mut rng = random_stream(1, "features", physics_parameters as u64);
            let mut draws =
                |n: usize| -> Vec<f32> { (0..n * lanes).map(|_| StandardNormal.sample(&mut rng)).collect() };
            let (features, latents) = (draws(sizes.condition), draws(sizes.latent));

            let mut runner = StepRunner::new(&net, &params, lanes);
            let (u, w) = runner.input();
            u.copy_from_slice(&features);
            w.copy_from_slice(&latents);
            let (mean, sd) = runner.run();

            let (mut tape, mut bound) = (Tape::new(), Bound::default());
            params.bind_frozen(&mut tape, &mut bound).unwrap();
            let u = tape.constant(&[1, sizes.condition, lanes], &features).unwrap();
            let w = tape.constant(&[1, sizes.latent, lanes], &latents).unwrap();
            let taped = net.correct(&mut tape, &bound, u, w).unwrap();
            for (ours, theirs) in [(mean, taped.mean), (sd, taped.sd)] {
                for (a, b) in ours.iter().zip(tape.value(theirs)) {
                    // The two sum about ten products in different orders.
                    assert!((a - b).abs() < 1e-5, "{physics_parameters} parameters: {a} and {b}");
                }
            }
        }
    }
}
