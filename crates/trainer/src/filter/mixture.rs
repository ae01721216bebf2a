//! The filter: particles for what differs from trajectory to trajectory, a Gaussian state for each.
//!
//! The density of the rows seen so far given a latent is in closed form (up to the cubature), so the latents are moved by
//! Metropolis steps that leave their posterior as it is (resample-move: Gilks and Berzuini 2001; iterated batch importance
//! sampling: Chopin 2002). A row that tells much is taken in by degrees (tempering: Del Moral, Doucet, Jasra 2006).

use super::moments::{Gaussian, weighted};
use super::particles::{States, Workspace};
use super::weights::{effective, systematic};
use super::{Moments, Sensor, StartLaw, StepLaw};
use crate::latent::{cholesky, whiten};
use crate::{Samples, TrainerError};
use augsim_data::random_stream;
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Least share of effective particles before they are resampled and moved.
const ENOUGH: f64 = 0.5;
/// Share of effective particles to which one degree of a row may bring them.
const DEGREE: f64 = 0.25;
/// Metropolis steps of every particle after a resampling.
const MOVES: usize = 2;
/// Size of a move: a preconditioned Crank-Nicolson step keeps sqrt(1 - MOVE^2) of where it was.
const MOVE: f64 = 0.7;
/// Degrees in which one row may be taken in. Each narrows the posterior at least fourfold, so that only a row that no
/// particle explains needs more.
const MOST_DEGREES: usize = 40;

/// Part of their standard deviations by which the states of all particles may differ and still count as one (or the law's own
/// resolution, where that is more): nothing that was seen then tells latents apart. Without the resolution the small errors of
/// a net along a smooth flight, the same from row to row, were read as evidence: behind 55 exact rows of a falling ball the 90 %
/// band held 82 %.
const ALIKE: f64 = 0.1;

/// A filter under way. Two with the same law, seed and rows give the same bytes.
pub struct Filter<'m> {
    law: Box<dyn StepLaw + 'm>,
    sensor: Sensor,
    start: StartLaw,
    actions: &'m [f64],
    width: usize,
    rng: Xoshiro256PlusPlus,
    stream: (u64, u64),
    count: usize,
    /// Rows seen, `[t, S]`.
    rows: Vec<f64>,
    /// `[n, L]`.
    latents: Vec<f64>,
    states: States,
    /// Log weights, `[n]`.
    weights: Vec<f64>,
    /// Log density of the rows seen behind `alike`, `[n]`.
    prefix: Vec<f64>,
    /// Rows after which the states of all particles were still one, and that state: what came before is not replayed.
    alike: (usize, Gaussian),
    /// Whether they still are.
    is_alike: bool,
    workspace: Workspace,
}

impl std::fmt::Debug for Filter<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Filter").field("particles", &self.count).field("rows", &self.rows.len()).finish()
    }
}

impl<'m> Filter<'m> {
    /// A filter of `particles` that has seen nothing. `actions [T, A]` are known beforehand, `width` is A; `stream` is
    /// the seed and the place of the trajectory in its set.
    pub fn new(
        law: Box<dyn StepLaw + 'm>,
        (sensor, start): (Sensor, StartLaw),
        (actions, width): (&'m [f64], usize),
        particles: usize,
        stream: (u64, u64),
    ) -> Self {
        let sensor = sensor.no_better_than(|j| law.resolution(j));
        let mut rng = random_stream(stream.0, "filter", stream.1);
        let count = particles.max(2);
        let latents = law.draw(count, &mut rng);
        Filter {
            states: States::default(),
            weights: vec![0.0; count],
            prefix: vec![0.0; count],
            alike: (0, Gaussian::diagonal(&start.mean, &start.sd)),
            is_alike: true,
            workspace: Workspace::default(),
            rows: Vec::new(),
            law,
            sensor,
            start,
            actions,
            width,
            rng,
            stream,
            count,
            latents,
        }
    }

    /// Rows seen so far.
    pub fn seen(&self) -> usize {
        self.rows.len() / self.law.state_dim()
    }

    /// Takes in the next row `[S]`; columns that the sensor does not see are not read.
    ///
    /// # Errors
    /// [`TrainerError`] if the row has another width, a column that is seen has no value, no action leads to the row, or the law
    /// cannot be evaluated.
    pub fn observe(&mut self, row: &[f64]) -> Result<(), TrainerError> {
        self.check(row)?;
        if self.rows.is_empty() {
            self.rows.extend_from_slice(row);
            self.alike = (1, self.first_state(row));
            self.states = self.common_states();
            return Ok(());
        }
        if effective(&self.weights) < ENOUGH * self.count as f64 {
            self.resample();
            for _ in 0..MOVES {
                self.rejuvenate(None)?;
            }
        }
        let t = self.seen();
        let mut taken = 0.0;
        for degree in 1.. {
            let (mut next, mut density) = (self.states.clone(), vec![0.0; self.count]);
            let actions = [t - 1, t].map(|t| &self.actions[t * self.width..(t + 1) * self.width]);
            let (law, sensor) = (&mut *self.law, &self.sensor);
            self.workspace.step(law, &self.latents, &mut next, actions, (row, sensor), &mut density)?;
            let rest = 1.0 - taken;
            let part = if degree < MOST_DEGREES { self.degree(&density, rest) } else { rest };
            self.weights.iter_mut().zip(&density).for_each(|(w, d)| *w += part * d);
            taken += part;
            if part == rest {
                self.states = next;
                self.prefix.iter_mut().zip(&density).for_each(|(p, d)| *p += d);
                self.rows.extend_from_slice(row);
                if degree == 1 {
                    self.look_alike();
                } else {
                    self.is_alike = false;
                }
                return Ok(());
            }
            self.resample();
            for _ in 0..MOVES {
                self.rejuvenate(Some((row, taken)))?;
            }
        }
        Ok(())
    }

    fn check(&self, row: &[f64]) -> Result<(), TrainerError> {
        let (expected, t) = (self.law.state_dim(), self.seen());
        let rows = if self.width == 0 { usize::MAX } else { self.actions.len() / self.width };
        if row.len() != expected || t >= rows {
            return Err(TrainerError::Row { row: t, expected, found: row.len(), rows });
        }
        match self.sensor.seen().find(|(j, _)| !row[*j].is_finite()) {
            Some((column, _)) => Err(TrainerError::Unseen { row: t, column }),
            None => Ok(()),
        }
    }

    /// `samples` continuations of `horizon` rows behind the last one seen, `[horizon, S, sample]`.
    ///
    /// # Errors
    /// [`TrainerError`] if the law cannot be evaluated, or nothing was seen.
    pub fn forecast(&mut self, horizon: usize, samples: usize) -> Result<Samples, TrainerError> {
        let (l, s, t) = (self.law.latent_dim(), self.law.state_dim(), self.seen());
        if t == 0 {
            return Err(TrainerError::NoTrajectories { what: "the prefix" });
        }
        // A stream of its own: what is forecast now does not change what is seen later.
        let mut rng = random_stream(self.stream.0 ^ t as u64, "filtered-forecast", self.stream.1);
        let mut chosen = systematic(&self.weights, samples, &mut rng);
        // The first samples of a forecast stand for all of them (the paper's mean of ten).
        chosen.shuffle(&mut rng);
        let states = self.states.select(&chosen, s);
        let latents: Vec<f64> =
            chosen.iter().flat_map(|&i| self.latents[i * l..(i + 1) * l].iter().copied()).collect();
        let mut now = states.mean;
        for (x, covariance) in now.chunks_exact_mut(s).zip(states.covariance.chunks_exact(s * s)) {
            let factor = cholesky(covariance, s);
            let draws: Vec<f64> = (0..s).map(|_| StandardNormal.sample(&mut rng)).collect();
            for (j, x) in x.iter_mut().enumerate() {
                *x += (0..=j).map(|k| factor[j * s + k] * draws[k]).sum::<f64>();
            }
        }
        let (mut mean, mut variance) = (vec![0.0; samples * s], vec![0.0; samples * s]);
        let mut values = vec![0.0; horizon * s * samples];
        for step in 0..horizon {
            let actions =
                [t + step - 1, t + step].map(|t| &self.actions[t * self.width..(t + 1) * self.width]);
            let next = Moments { mean: &mut mean, variance: &mut variance };
            self.law.advance(&now, &latents, actions, next)?;
            for (sample, x) in now.chunks_exact_mut(s).enumerate() {
                for (j, x) in x.iter_mut().enumerate() {
                    let (at, draw): (usize, f64) = (sample * s + j, StandardNormal.sample(&mut rng));
                    *x = mean[at] + variance[at].sqrt() * draw;
                    values[(step * s + j) * samples + sample] = *x as f32;
                }
            }
        }
        Ok(Samples { count: samples, values })
    }

    /// The first state: the law of first states, corrected by the first row.
    fn first_state(&self, row: &[f64]) -> Gaussian {
        let mut first = Gaussian::diagonal(&self.start.mean, &self.start.sd);
        for (j, variance) in self.sensor.seen() {
            first.measure(j, row[j], variance);
        }
        if self.sensor.is_exact() {
            first.mean.copy_from_slice(row);
            first.covariance.fill(0.0);
        }
        first
    }

    /// The states of all particles where they are one.
    fn common_states(&self) -> States {
        let Gaussian { mean, covariance } = &self.alike.1;
        States { mean: mean.repeat(self.count), covariance: covariance.repeat(self.count) }
    }

    /// Forgets the rows so far if they tell no latents apart: the states of all particles are still one.
    fn look_alike(&mut self) {
        let (n, s) = (self.count, self.law.state_dim());
        let cloud = weighted(&self.states.mean, &vec![1.0; n], s);
        let mut covariance = vec![0.0; s * s];
        for one in self.states.covariance.chunks_exact(s * s) {
            covariance.iter_mut().zip(one).for_each(|(sum, v)| *sum += v / n as f64);
        }
        let differ = |j: usize| {
            let limit = (ALIKE * ALIKE * covariance[j * s + j]).max(self.law.resolution(j).powi(2));
            self.states.mean.iter().skip(j).step_by(s).any(|m| (m - cloud.mean[j]).powi(2) > limit)
        };
        self.is_alike &= !(0..s).any(differ);
        if self.is_alike {
            self.alike = (self.seen(), Gaussian { mean: cloud.mean, covariance });
            self.states = self.common_states();
            self.weights.fill(0.0);
            self.prefix.fill(0.0);
        }
    }

    /// The largest part of a row's log density, at most `rest`, that leaves enough particles effective.
    fn degree(&self, density: &[f64], rest: f64) -> f64 {
        let after = |part: f64| {
            let weights: Vec<f64> = self.weights.iter().zip(density).map(|(w, d)| w + part * d).collect();
            effective(&weights)
        };
        let enough = DEGREE * self.count as f64;
        if after(rest) >= enough {
            return rest;
        }
        let (mut low, mut high) = (0.0, rest);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if after(middle) >= enough { low = middle } else { high = middle }
        }
        low
    }

    /// Makes all weights equal.
    fn resample(&mut self) {
        self.is_alike = false;
        let (l, s) = (self.law.latent_dim(), self.law.state_dim());
        let chosen = systematic(&self.weights, self.count, &mut self.rng);
        self.states = self.states.select(&chosen, s);
        self.latents = chosen.iter().flat_map(|&i| self.latents[i * l..(i + 1) * l].to_vec()).collect();
        self.prefix = chosen.iter().map(|&i| self.prefix[i]).collect();
        self.weights.fill(0.0);
    }

    /// One Metropolis step of every latent under its posterior given the rows seen, and the given part of the log density of a
    /// row that is being taken in. Proposals are preconditioned Crank-Nicolson steps (Cotter et al. 2013) about the particles'
    /// own mean and covariance.
    fn rejuvenate(&mut self, partial: Option<(&[f64], f64)>) -> Result<(), TrainerError> {
        let (l, s, n) = (self.law.latent_dim(), self.law.state_dim(), self.count);
        let cloud = weighted(&self.latents, &vec![1.0; n], l);
        let factor = cholesky(&cloud.covariance, l);
        let mut proposed = vec![0.0; n * l];
        let mut odds = vec![0.0; n];
        for i in 0..n {
            let white = whiten(&self.latents[i * l..(i + 1) * l], &cloud.mean, &factor);
            let moved: Vec<f64> = (white.iter())
                .map(|v| {
                    let draw: f64 = StandardNormal.sample(&mut self.rng);
                    (1.0 - MOVE * MOVE).sqrt() * v + MOVE * draw
                })
                .collect();
            for j in 0..l {
                let shift: f64 = (0..=j).map(|k| factor[j * l + k] * moved[k]).sum();
                proposed[i * l + j] = cloud.mean[j] + shift;
            }
            let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
            odds[i] = 0.5 * (square(&moved) - square(&white));
        }
        let (states, prefix) = self.replay(&proposed)?;
        let (mut now, mut then) = (vec![0.0; n], vec![0.0; n]);
        if let Some((row, part)) = partial {
            let t = self.seen();
            for (latents, states, density) in
                [(&self.latents, &self.states, &mut now), (&proposed, &states, &mut then)]
            {
                let actions = [t - 1, t].map(|t| &self.actions[t * self.width..(t + 1) * self.width]);
                let mut next = states.clone();
                let (law, sensor) = (&mut *self.law, &self.sensor);
                self.workspace.step(law, latents, &mut next, actions, (row, sensor), density)?;
                density.iter_mut().for_each(|d| *d *= part);
            }
        }
        for i in 0..n {
            let at = i * l..(i + 1) * l;
            let prior =
                self.law.log_density(&proposed[at.clone()]) - self.law.log_density(&self.latents[at.clone()]);
            let ratio = odds[i] + prior + prefix[i] - self.prefix[i] + then[i] - now[i];
            let draw: f64 = self.rng.random();
            if draw.ln() < ratio {
                self.latents[at.clone()].copy_from_slice(&proposed[at]);
                self.states.copy_one(&states, i, s);
                self.prefix[i] = prefix[i];
            }
        }
        Ok(())
    }

    /// States after all rows seen, and the log density of the rows that tell latents apart, for other latents.
    fn replay(&mut self, latents: &[f64]) -> Result<(States, Vec<f64>), TrainerError> {
        let s = self.law.state_dim();
        let mut states = self.common_states();
        let mut density = vec![0.0; self.count];
        for t in self.alike.0..self.seen() {
            let actions = [t - 1, t].map(|t| &self.actions[t * self.width..(t + 1) * self.width]);
            let seen = (&self.rows[t * s..(t + 1) * s], &self.sensor);
            self.workspace.step(&mut *self.law, latents, &mut states, actions, seen, &mut density)?;
        }
        Ok((states, density))
    }
}

#[cfg(test)]
mod tests {
    //! Contract: on a law whose posterior has a closed form the filter gives it; a forecast depends on seed and rows alone, and
    //! not on what is seen later.
    use super::super::weights::shares;
    use super::*;

    /// A walk that drifts by what its latent says: x' = x + w + noise, w ~ N(0, 1).
    #[derive(Debug)]
    struct Drift;

    /// Standard deviations of a step and of the sensor.
    const STEP: f64 = 0.1;
    const SEEN: f64 = 0.3;

    impl StepLaw for Drift {
        fn latent_dim(&self) -> usize {
            1
        }
        fn state_dim(&self) -> usize {
            1
        }
        fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
            (0..count).map(|_| StandardNormal.sample(rng)).collect()
        }
        fn log_density(&self, latent: &[f64]) -> f64 {
            -0.5 * latent[0] * latent[0]
        }
        fn advance(
            &mut self,
            states: &[f64],
            latents: &[f64],
            _: [&[f64]; 2],
            next: Moments<'_>,
        ) -> Result<(), TrainerError> {
            for ((mean, x), w) in next.mean.iter_mut().zip(states).zip(latents) {
                *mean = x + w;
            }
            next.variance.fill(STEP * STEP);
            Ok(())
        }
    }

    fn filter(rows: &[f64], seed: u64) -> Filter<'static> {
        let start = StartLaw { mean: vec![0.0], sd: vec![1.0] };
        let sensor = Sensor::new(vec![Some(SEEN)]).unwrap();
        let mut filter = Filter::new(Box::new(Drift), (sensor, start), (&[], 0), 2000, (seed, 0));
        rows.iter().for_each(|row| filter.observe(&[*row]).unwrap());
        filter
    }

    /// Posterior of (x, w) behind the rows by Kalman's filter on the joint state.
    fn exact(rows: &[f64]) -> Gaussian {
        let mut joint = Gaussian::diagonal(&[0.0, 0.0], &[1.0, 1.0]);
        for (t, row) in rows.iter().enumerate() {
            if t > 0 {
                joint.mean[0] += joint.mean[1];
                let [a, b, _, d] = joint.covariance[..] else { panic!("two by two") };
                joint.covariance = vec![a + 2.0 * b + d + STEP * STEP, b + d, b + d, d];
            }
            joint.measure(0, *row, SEEN * SEEN);
        }
        joint
    }

    #[test]
    fn the_posterior_of_a_linear_law_is_its_closed_form() {
        // A drift of 2.5 lies far out in the prior: it is reached by degrees.
        let rows: Vec<f64> = (0..12).map(|t| 2.5 * f64::from(t) + 0.2 * f64::from(t % 3)).collect();
        for n in [2, 4, 12] {
            let found = filter(&rows[..n], 1);
            let weights = shares(&found.weights);
            let w = weighted(&found.latents, &weights, 1);
            let wanted = exact(&rows[..n]);
            // 2,000 particles that moves have made nearly independent: four standard errors of mean and deviation.
            let (mean, sd) = (wanted.mean[1], wanted.covariance[3].sqrt());
            assert!((w.mean[0] - mean).abs() < 4.0 * sd / 1000_f64.sqrt(), "n {n}: {} {mean}", w.mean[0]);
            assert!(
                (w.covariance[0].sqrt() / sd - 1.0).abs() < 0.1,
                "n {n}: {} {sd}",
                w.covariance[0].sqrt()
            );
        }
    }

    #[test]
    fn bands_of_forecasts_are_those_of_the_closed_form() {
        let rows = [0.1, 0.8, 1.3, 2.2];
        let joint = exact(&rows);
        let samples = filter(&rows, 2).forecast(3, 4000).unwrap();
        let last = &samples.values[2 * 4000..];
        let mean = last.iter().map(|v| f64::from(*v)).sum::<f64>() / 4000.0;
        let variance = last.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / 4000.0;
        let [a, b, _, d] = joint.covariance[..] else { panic!("two by two") };
        let wanted = a + 6.0 * b + 9.0 * d + 3.0 * STEP * STEP;
        assert!((mean - joint.mean[0] - 3.0 * joint.mean[1]).abs() < 4.0 * (wanted / 1000.0).sqrt());
        assert!((variance / wanted - 1.0).abs() < 0.15, "{variance} {wanted}");
    }

    #[test]
    fn a_forecast_depends_on_seed_and_rows_and_not_on_what_comes_later() {
        let early = filter(&[0.1, 0.8], 3).forecast(2, 50).unwrap();
        assert_eq!(filter(&[0.1, 0.8], 3).forecast(2, 50).unwrap(), early);
        assert_ne!(filter(&[0.1, 0.8], 4).forecast(2, 50).unwrap(), early);
        let mut streamed = filter(&[0.1, 0.8], 3);
        assert_eq!(streamed.forecast(2, 50).unwrap(), early);
        // What is forecast now does not change what is forecast later.
        let _ = streamed.observe(&[1.6]);
        assert_eq!(streamed.forecast(2, 50).unwrap(), filter(&[0.1, 0.8, 1.6], 3).forecast(2, 50).unwrap());
    }

    #[test]
    fn a_row_that_is_none_is_refused_and_changes_nothing() {
        let mut filter = filter(&[0.1], 1);
        assert!(matches!(filter.observe(&[f64::NAN]), Err(TrainerError::Unseen { row: 1, column: 0 })));
        assert!(matches!(filter.observe(&[0.2, 0.3]), Err(TrainerError::Row { row: 1, found: 2, .. })));
        assert_eq!(filter.seen(), 1);
    }

    #[test]
    fn nothing_is_forecast_behind_nothing() {
        assert!(filter(&[], 1).forecast(2, 10).is_err());
    }
}
