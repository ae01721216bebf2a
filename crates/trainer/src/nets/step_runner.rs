//! The decoder of Hybrid+ without a tape: corrections of single physics steps, many at once.

use super::Stepwise;
use augsim_nn::Params;
use augsim_nn::inference::{GaussianRunner, LinearRunner, MlpRunner};

/// The decoder of a [`Stepwise`] net without memory, for a number of steps in lanes. Nothing is allocated after construction.
#[derive(Debug, Clone)]
pub struct StepRunner {
    step: MlpRunner,
    head: GaussianRunner,
    own: Option<LinearRunner>,
    mean: Vec<f32>,
    read: Vec<f32>,
    condition: usize,
    lanes: usize,
}

impl StepRunner {
    /// The decoder of `net` for `lanes` steps at once.
    pub fn new(net: &Stepwise, params: &Params<f32>, lanes: usize) -> Self {
        let sizes = net.sizes();
        let (step, head, own) = net.decoder();
        StepRunner {
            step: MlpRunner::new(step, params, lanes, 1),
            head: GaussianRunner::new(head, params, lanes, 1),
            own: own.map(|own| LinearRunner::new(own, params, lanes, 1)),
            mean: vec![0.0; sizes.state * lanes],
            read: vec![0.0; (sizes.condition + sizes.latent) * lanes],
            condition: sizes.condition,
            lanes,
        }
    }

    /// Steps at once.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Where the features `[U, lane]` and the latents `[L, lane]` of the next call are written.
    pub fn input(&mut self) -> (&mut [f32], &mut [f32]) {
        self.read.split_at_mut(self.condition * self.lanes)
    }

    /// Mean and standard deviation `[S, lane]` of the corrections for what [`input`](Self::input) holds.
    pub fn run(&mut self) -> (&[f32], &[f32]) {
        let (features, w) = self.read.split_at(self.condition * self.lanes);
        let (mean, sd) = self.head.run(self.step.run(&self.read, 1), 1);
        self.mean.copy_from_slice(mean);
        if let Some(own) = &mut self.own {
            let shifts = own.run(w, 1);
            let changes = &features[features.len() - self.mean.len() * shifts.len() / self.lanes..];
            for (changes, shift) in changes.chunks_exact(self.mean.len()).zip(shifts.chunks_exact(self.lanes))
            {
                let moved = changes.iter().zip(shift.iter().cycle());
                self.mean.iter_mut().zip(moved).for_each(|(mean, (change, shift))| *mean += change * shift);
            }
        }
        (&self.mean, sd)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the runner gives what the tape gives, with and without parameters of the physics that the latent moves.
    use super::*;
    use crate::nets::StepwiseSizes;
    use augsim_data::random_stream;
    use augsim_nn::Bound;
    use augsim_tensor::Tape;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn runner_gives_what_the_tape_gives() {
        let lanes = 5;
        for own in [0, 1, 2] {
            let sizes = StepwiseSizes {
                state: 2,
                condition: 10 + 2 * own,
                latent: 3,
                hidden: 8,
                sd_floor: 1e-2,
                own,
            };
            let mut params = Params::<f32>::new(random_stream(1, "init", own as u64));
            let net = Stepwise::new(&mut params, sizes);
            let mut rng = random_stream(1, "features", own as u64);
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
                    // Sums of some ten products in another order.
                    assert!((a - b).abs() < 1e-5, "{own} parameters: {a} and {b}");
                }
            }
        }
    }
}
