//! A Rao-Blackwellised particle filter: particles for the latents, a Gaussian state for each particle.
//!
//! The density of the observed rows given a latent is known up to the cubature error, so the latents are
//! moved by Metropolis steps that leave their posterior invariant (resample-move: Gilks and Berzuini 2001;
//! iterated batch importance sampling: Chopin 2002). A very informative row is assimilated in several
//! tempering steps (Del Moral, Doucet, Jasra 2006): the particles w are weighted by
//!
//! ```text
//! (1)  p(row | rows before, w)^(b_k - b_(k-1)),    0 = b_0 < b_1 < ... < b_K = 1,
//! ```
//!
//! and are resampled and moved between the steps.

use super::moments::{Gaussian, weighted_into};
use super::particles::{States, Workspace, gather_rows};
use super::weights::{effective_size_into, largest_increment, resample_into};
use super::{InitialStatePrior, Moments, Sensor, TransitionModel};
use crate::latent::{cholesky_into, whiten_into};
use crate::{Samples, TrainerError};
use augsim_data::random_stream;
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Effective sample size, as a share of the particles, below which they are resampled and moved.
const RESAMPLING_THRESHOLD: f64 = 0.5;
/// Minimum effective sample size after one tempering step, as a share of the particles.
const MIN_TEMPERED_SHARE: f64 = 0.25;
/// Number of Metropolis steps of every particle after a resampling.
const MOVES_PER_RESAMPLING: usize = 2;
/// Size of a Metropolis move: a Crank-Nicolson step keeps sqrt(1 - MOVE_SIZE^2) of the old value.
const MOVE_SIZE: f64 = 0.7;
/// Maximum number of tempering steps of one row.
/// Each step narrows the posterior at least fourfold, so only a row that no particle explains needs more.
const MAX_TEMPERING_STEPS: usize = 40;

/// Largest difference of the particles' states that still counts as equal, in standard deviations.
/// The transition model's own resolution replaces it where that is larger. As long as the states are equal
/// in this sense, the observed rows carry no information about the latents. Without the resolution the
/// small errors of a net along a smooth flight, the same from row to row, were taken for information: after
/// 55 exact rows of a falling ball the 90 % band held 82 %.
const SHARED_STATE_TOLERANCE: f64 = 0.1;

/// A particle filter over the observed rows of one trajectory.
/// Two filters with the same transition model, seed and rows give identical bytes.
pub struct Filter<'m> {
    model: Box<dyn TransitionModel + 'm>,
    sensor: Sensor,
    start: InitialStatePrior,
    actions: &'m [f64],
    width: usize,
    rng: Xoshiro256PlusPlus,
    stream: (u64, u64),
    count: usize,
    /// Observed rows of the trajectory, `[t, S]`.
    rows: Vec<f64>,
    /// Latents of the n particles, `[n, L]`.
    latents: Vec<f64>,
    states: States,
    /// Log weights of the n particles, `[n]`.
    weights: Vec<f64>,
    /// For each particle, log density of the rows observed after those of `shared_state`, `[n]`.
    prefix_log_density: Vec<f64>,
    /// Number of first rows after which all particles had one state, and that state.
    /// These rows are not simulated again when latents are moved.
    shared_state: (usize, Gaussian),
    /// Whether all particles still have the same state.
    is_shared: bool,
    /// Whether the latents include the initial state.
    has_initial_state_latents: bool,
    workspace: Workspace,
    scratch: Scratch,
    samples: Samples,
}

/// Number of observed rows for which memory is reserved; more rows allocate again.
const RESERVED_ROWS: usize = 4096;

/// Scratch buffers of the filter; nothing is allocated once each has been used.
#[derive(Debug, Clone, Default)]
struct Scratch {
    next: States,
    replayed: States,
    proposed: Vec<f64>,
    gathered: Vec<f64>,
    log_proposal_ratios: Vec<f64>,
    row_log_density: Vec<f64>,
    prefix_log_density: Vec<f64>,
    log_densities: Vec<f64>,
    proposed_log_densities: Vec<f64>,
    shares: Vec<f64>,
    chosen: Vec<usize>,
    particle_moments: Gaussian,
    factor: Vec<f64>,
    whitened: Vec<f64>,
    moved: Vec<f64>,
    mean: Vec<f64>,
    variance: Vec<f64>,
}

impl Scratch {
    /// Reserves memory for `n` particles with `l` latents and `s` state columns.
    /// Without it the first resampling, at an impact, would take longer than the later ones.
    fn with_capacity(n: usize, l: usize, s: usize) -> Self {
        let (buffer, max_width) = (|count: usize| Vec::with_capacity(count), l.max(s));
        let states = || States { mean: Vec::with_capacity(n * s), covariance: Vec::with_capacity(n * s * s) };
        Scratch {
            next: states(),
            replayed: states(),
            proposed: buffer(n * l),
            gathered: buffer(n * max_width),
            log_proposal_ratios: buffer(n),
            row_log_density: buffer(n),
            prefix_log_density: buffer(n),
            log_densities: buffer(n),
            proposed_log_densities: buffer(n),
            shares: buffer(n),
            chosen: Vec::with_capacity(n),
            particle_moments: Gaussian { mean: buffer(max_width), covariance: buffer(max_width * max_width) },
            factor: buffer(max_width * max_width),
            whitened: buffer(max_width),
            moved: buffer(max_width),
            mean: Vec::new(),
            variance: Vec::new(),
        }
    }
}

impl std::fmt::Debug for Filter<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Filter").field("particles", &self.count).field("rows", &self.rows.len()).finish()
    }
}

impl<'m> Filter<'m> {
    /// Creates a filter of `particles` particles before any row is observed.
    /// `actions [T, A]` are known in advance and `width` is A; `stream` holds the seed and the index of the
    /// trajectory in its set.
    pub fn new(
        model: Box<dyn TransitionModel + 'm>,
        (sensor, start): (Sensor, InitialStatePrior),
        (actions, width): (&'m [f64], usize),
        particles: usize,
        stream: (u64, u64),
    ) -> Self {
        let sensor = sensor.with_min_sd(|j| model.resolution(j));
        let mut rng = random_stream(stream.0, "filter", stream.1);
        let count = particles.max(2);
        let latents = model.draw(count, &mut rng);
        Filter {
            states: States::default(),
            weights: vec![0.0; count],
            prefix_log_density: vec![0.0; count],
            shared_state: (0, Gaussian::diagonal(&start.mean, &start.sd)),
            is_shared: true,
            has_initial_state_latents: false,
            workspace: Workspace::default(),
            scratch: Scratch::with_capacity(count, model.latent_dim(), model.state_dim()),
            samples: Samples { count: 0, values: Vec::new() },
            rows: Vec::with_capacity(RESERVED_ROWS * model.state_dim()),
            model,
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

    /// Number of rows observed so far.
    pub fn observed_rows(&self) -> usize {
        self.rows.len() / self.model.state_dim()
    }

    /// Assimilates the next row `[S]`; columns that the sensor does not observe are not read.
    ///
    /// # Errors
    /// [`TrainerError`] if the row has another width, an observed column has no value, no action leads to
    /// the row, or the transition model cannot be evaluated.
    pub fn observe(&mut self, row: &[f64]) -> Result<(), TrainerError> {
        self.check(row)?;
        if self.rows.is_empty() {
            self.rows.extend_from_slice(row);
            let initial_state = self.first_state(row);
            self.is_shared = !self.model.set_initial_state(&initial_state.mean, &initial_state.covariance);
            self.has_initial_state_latents = !self.is_shared;
            self.shared_state = (1, initial_state);
            let mut states = std::mem::take(&mut self.states);
            self.write_shared_states(&self.latents, &mut states);
            self.states = states;
            return Ok(());
        }
        // The scratch buffers are put back after the call, also when it fails.
        let mut scratch = std::mem::take(&mut self.scratch);
        let result = self.assimilate(row, &mut scratch);
        self.scratch = scratch;
        result
    }

    fn assimilate(&mut self, row: &[f64], scratch: &mut Scratch) -> Result<(), TrainerError> {
        let resampling_limit = RESAMPLING_THRESHOLD * self.count as f64;
        if effective_size_into(self.weights.iter().copied(), &mut scratch.shares) < resampling_limit {
            self.resample(scratch);
            for _ in 0..MOVES_PER_RESAMPLING {
                self.rejuvenate(None, scratch)?;
            }
        }
        let t = self.observed_rows();
        let mut exponent = 0.0;
        for tempering_step in 1.. {
            scratch.next.copy_from(&self.states);
            resize_with_zeros(&mut scratch.row_log_density, self.count);
            let actions = actions_before_and_at(self.actions, self.width, t);
            let observation = (row, &self.sensor);
            let (next, row_log_density) = (&mut scratch.next, &mut scratch.row_log_density);
            self.workspace.step(
                &mut *self.model,
                &self.latents,
                next,
                actions,
                observation,
                row_log_density,
            )?;
            let remaining = 1.0 - exponent;
            let increment = match tempering_step < MAX_TEMPERING_STEPS {
                true => self.tempering_increment(&scratch.row_log_density, remaining, &mut scratch.shares),
                false => remaining,
            };
            self.weights.iter_mut().zip(&scratch.row_log_density).for_each(|(w, d)| *w += increment * d);
            exponent += increment;
            if increment == remaining {
                std::mem::swap(&mut self.states, &mut scratch.next);
                self.prefix_log_density.iter_mut().zip(&scratch.row_log_density).for_each(|(p, d)| *p += d);
                self.rows.extend_from_slice(row);
                if tempering_step == 1 {
                    self.merge_equal_states(scratch);
                } else {
                    self.is_shared = false;
                }
                return Ok(());
            }
            self.resample(scratch);
            for _ in 0..MOVES_PER_RESAMPLING {
                self.rejuvenate(Some((row, exponent)), scratch)?;
            }
        }
        Ok(())
    }

    fn check(&self, row: &[f64]) -> Result<(), TrainerError> {
        let (expected, t) = (self.model.state_dim(), self.observed_rows());
        let rows = self.actions.len().checked_div(self.width).unwrap_or(usize::MAX);
        if row.len() != expected || t >= rows {
            return Err(TrainerError::Row { row: t, expected, found: row.len(), rows });
        }
        match self.sensor.observed_columns().find(|(j, _)| !row[*j].is_finite()) {
            Some((column, _)) => Err(TrainerError::MissingMeasurement { row: t, column }),
            None => Ok(()),
        }
    }

    /// Draws `samples` continuations of `horizon` rows after the last observed row, `[horizon, S, sample]`.
    ///
    /// # Errors
    /// [`TrainerError`] if the transition model cannot be evaluated, no row was observed, or the actions
    /// end before the horizon.
    pub fn forecast(&mut self, horizon: usize, samples: usize) -> Result<&Samples, TrainerError> {
        if self.observed_rows() == 0 {
            return Err(TrainerError::NoTrajectories { what: "the observed prefix" });
        }
        let (last_row, s) = (self.observed_rows() + horizon, self.model.state_dim());
        if self.width > 0 && last_row * self.width > self.actions.len() {
            let rows = self.actions.len() / self.width;
            return Err(TrainerError::Row { row: last_row - 1, expected: s, found: s, rows });
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        let result = self.draw(horizon, samples, &mut scratch);
        self.scratch = scratch;
        result?;
        Ok(&self.samples)
    }

    fn draw(&mut self, horizon: usize, samples: usize, scratch: &mut Scratch) -> Result<(), TrainerError> {
        let (l, s, t) = (self.model.latent_dim(), self.model.state_dim(), self.observed_rows());
        // A separate random stream, so that forecasting now does not change what is inferred from later
        // rows.
        let mut rng = random_stream(self.stream.0 ^ t as u64, "filtered-forecast", self.stream.1);
        let Scratch { next, proposed: latents, shares, chosen, factor, moved: draws, mean, variance, .. } =
            scratch;
        resample_into(&self.weights, samples, &mut rng, shares, chosen);
        // Shuffled, so that the first samples represent all of them: the paper's estimate is the mean of ten.
        chosen.shuffle(&mut rng);
        next.select_from(&self.states, chosen, s);
        gather_rows(&self.latents, chosen, l, latents);
        resize_with_zeros(factor, s * s);
        let States { mean: states, covariance } = next;
        for (x, covariance) in states.chunks_exact_mut(s).zip(covariance.chunks_exact(s * s)) {
            cholesky_into(covariance, s, factor);
            draws.clear();
            draws.extend((0..s).map(|_| -> f64 { StandardNormal.sample(&mut rng) }));
            for (j, x) in x.iter_mut().enumerate() {
                *x += (0..=j).map(|k| factor[j * s + k] * draws[k]).sum::<f64>();
            }
        }
        resize_with_zeros(mean, samples * s);
        resize_with_zeros(variance, samples * s);
        let values = &mut self.samples.values;
        values.clear();
        values.resize(horizon * s * samples, 0.0);
        self.samples.count = samples;
        for step in 0..horizon {
            let actions = actions_before_and_at(self.actions, self.width, t + step);
            self.model.advance(states, latents, actions, Moments { mean, variance })?;
            for (sample, x) in states.chunks_exact_mut(s).enumerate() {
                for (j, x) in x.iter_mut().enumerate() {
                    let (index, draw): (usize, f64) = (sample * s + j, StandardNormal.sample(&mut rng));
                    *x = mean[index] + variance[index].sqrt() * draw;
                    values[(step * s + j) * samples + sample] = *x as f32;
                }
            }
        }
        Ok(())
    }

    /// Computes the distribution of the initial state: its prior, updated by the first row.
    fn first_state(&self, row: &[f64]) -> Gaussian {
        let mut initial = Gaussian::diagonal(&self.start.mean, &self.start.sd);
        for (j, variance) in self.sensor.observed_columns() {
            initial.measure(j, row[j], variance);
        }
        if self.sensor.is_exact() {
            initial.mean.copy_from_slice(row);
            initial.covariance.fill(0.0);
        }
        initial
    }

    /// Replaces the particles' states by their mean and resets the weights, while the states are equal.
    /// The rows observed so far then carry no information about the latents and need not be simulated again.
    fn merge_equal_states(&mut self, scratch: &mut Scratch) {
        let (n, s) = (self.count, self.model.state_dim());
        let Scratch { particle_moments, factor: covariance, .. } = scratch;
        weighted_into(&self.states.mean, |_| 1.0, n as f64, s, particle_moments);
        resize_with_zeros(covariance, s * s);
        for covariance_of_one in self.states.covariance.chunks_exact(s * s) {
            covariance.iter_mut().zip(covariance_of_one).for_each(|(sum, v)| *sum += v / n as f64);
        }
        let differs = |j: usize| {
            let limit = (SHARED_STATE_TOLERANCE * SHARED_STATE_TOLERANCE * covariance[j * s + j])
                .max(self.model.resolution(j).powi(2));
            self.states.mean.iter().skip(j).step_by(s).any(|m| (m - particle_moments.mean[j]).powi(2) > limit)
        };
        self.is_shared &= !(0..s).any(differs);
        if self.is_shared {
            self.shared_state.0 = self.observed_rows();
            self.shared_state.1.mean.copy_from_slice(&particle_moments.mean);
            self.shared_state.1.covariance.copy_from_slice(covariance);
            self.states.repeat(&self.shared_state.1, self.count);
            self.weights.fill(0.0);
            self.prefix_log_density.fill(0.0);
        }
    }

    /// Finds the largest tempering increment, at most `remaining`, that keeps the minimum effective sample size.
    fn tempering_increment(&self, row_log_density: &[f64], remaining: f64, shares: &mut Vec<f64>) -> f64 {
        let tempered =
            |increment: f64| self.weights.iter().zip(row_log_density).map(move |(w, d)| w + increment * d);
        let effective_size = |increment: f64| effective_size_into(tempered(increment), shares);
        largest_increment(effective_size, remaining, MIN_TEMPERED_SHARE * self.count as f64)
    }

    /// Resamples the particles in proportion to their weights and makes all weights equal.
    fn resample(&mut self, scratch: &mut Scratch) {
        self.is_shared = false;
        let (l, s) = (self.model.latent_dim(), self.model.state_dim());
        let Scratch { next, gathered, shares, chosen, .. } = scratch;
        resample_into(&self.weights, self.count, &mut self.rng, shares, chosen);
        next.select_from(&self.states, chosen, s);
        std::mem::swap(&mut self.states, next);
        gather_rows(&self.latents, chosen, l, gathered);
        std::mem::swap(&mut self.latents, gathered);
        gather_rows(&self.prefix_log_density, chosen, 1, gathered);
        self.prefix_log_density.copy_from_slice(gathered);
        self.weights.fill(0.0);
    }

    /// Makes one Metropolis step of every particle's latent, which leaves the posterior invariant.
    /// `partial` is a row that is being assimilated, with the tempering exponent reached so far. Proposals
    /// are preconditioned Crank-Nicolson steps (Cotter et al. 2013) about the particles' own mean and
    /// covariance.
    fn rejuvenate(
        &mut self,
        partial: Option<(&[f64], f64)>,
        scratch: &mut Scratch,
    ) -> Result<(), TrainerError> {
        let (l, s, n) = (self.model.latent_dim(), self.model.state_dim(), self.count);
        self.propose(scratch);
        self.replay(scratch)?;
        resize_with_zeros(&mut scratch.log_densities, n);
        resize_with_zeros(&mut scratch.proposed_log_densities, n);
        if let Some((row, exponent)) = partial {
            let actions = actions_before_and_at(self.actions, self.width, self.observed_rows());
            let Scratch { next, replayed, proposed, log_densities, proposed_log_densities, .. } = scratch;
            for (latents, states, row_log_density) in [
                (&self.latents, &self.states, log_densities),
                (&*proposed, &*replayed, proposed_log_densities),
            ] {
                next.copy_from(states);
                let observation = (row, &self.sensor);
                self.workspace.step(
                    &mut *self.model,
                    latents,
                    next,
                    actions,
                    observation,
                    row_log_density,
                )?;
                row_log_density.iter_mut().for_each(|d| *d *= exponent);
            }
        }
        for i in 0..n {
            let range = i * l..(i + 1) * l;
            let proposed = &scratch.proposed[range.clone()];
            let log_prior_ratio =
                self.model.log_density(proposed) - self.model.log_density(&self.latents[range.clone()]);
            let log_likelihood_ratio = scratch.prefix_log_density[i] - self.prefix_log_density[i];
            let log_acceptance = scratch.log_proposal_ratios[i]
                + log_prior_ratio
                + log_likelihood_ratio
                + scratch.proposed_log_densities[i]
                - scratch.log_densities[i];
            let draw: f64 = self.rng.random();
            if draw.ln() < log_acceptance {
                self.latents[range].copy_from_slice(proposed);
                self.states.copy_one(&scratch.replayed, i, s);
                self.prefix_log_density[i] = scratch.prefix_log_density[i];
            }
        }
        Ok(())
    }

    /// Proposes new latents of the particles and computes the logarithms of their proposal ratios.
    fn propose(&mut self, scratch: &mut Scratch) {
        let (l, n) = (self.model.latent_dim(), self.count);
        let Scratch { proposed, log_proposal_ratios, particle_moments, factor, whitened, moved, .. } =
            scratch;
        weighted_into(&self.latents, |_| 1.0, n as f64, l, particle_moments);
        resize_with_zeros(factor, l * l);
        cholesky_into(&particle_moments.covariance, l, factor);
        resize_with_zeros(proposed, n * l);
        resize_with_zeros(log_proposal_ratios, n);
        resize_with_zeros(whitened, l);
        resize_with_zeros(moved, l);
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        for i in 0..n {
            whiten_into(&self.latents[i * l..(i + 1) * l], &particle_moments.mean, factor, whitened);
            for (moved, v) in moved.iter_mut().zip(&*whitened) {
                let draw: f64 = StandardNormal.sample(&mut self.rng);
                *moved = (1.0 - MOVE_SIZE * MOVE_SIZE).sqrt() * v + MOVE_SIZE * draw;
            }
            for j in 0..l {
                let shift: f64 = (0..=j).map(|k| factor[j * l + k] * moved[k]).sum();
                proposed[i * l + j] = particle_moments.mean[j] + shift;
            }
            log_proposal_ratios[i] = 0.5 * (square(moved) - square(whitened));
        }
    }

    /// Writes the particles' states after the first rows, which carry no information about the latents.
    fn write_shared_states(&self, latents: &[f64], states: &mut States) {
        states.repeat(&self.shared_state.1, self.count);
        if self.has_initial_state_latents {
            let (l, s) = (self.model.latent_dim(), self.model.state_dim());
            let particles = latents.chunks_exact(l).zip(states.mean.chunks_exact_mut(s));
            particles.for_each(|(latent, state)| self.model.initial_state(latent, state));
            states.covariance.fill(0.0);
        }
    }

    /// Simulates the proposed latents over the observed rows: states after them, and the rows' log density.
    fn replay(&mut self, scratch: &mut Scratch) -> Result<(), TrainerError> {
        let s = self.model.state_dim();
        let Scratch { replayed, prefix_log_density, proposed, .. } = scratch;
        self.write_shared_states(proposed, replayed);
        resize_with_zeros(prefix_log_density, self.count);
        for t in self.shared_state.0..self.observed_rows() {
            let actions = actions_before_and_at(self.actions, self.width, t);
            let observation = (&self.rows[t * s..(t + 1) * s], &self.sensor);
            self.workspace.step(
                &mut *self.model,
                proposed,
                replayed,
                actions,
                observation,
                prefix_log_density,
            )?;
        }
        Ok(())
    }
}

/// Returns the actions at sample `t - 1` and at sample `t`.
fn actions_before_and_at(actions: &[f64], width: usize, t: usize) -> [&[f64]; 2] {
    [t - 1, t].map(|t| &actions[t * width..(t + 1) * width])
}

/// Resizes `values` to `count` zeros.
fn resize_with_zeros(values: &mut Vec<f64>, count: usize) {
    values.clear();
    values.resize(count, 0.0);
}

#[cfg(test)]
mod tests;
