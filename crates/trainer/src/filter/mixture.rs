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
use super::weights::{effective_of, systematic_into};
use super::{Moments, Sensor, StartLaw, StepLaw};
use crate::latent::{cholesky_into, whiten_into};
use crate::{Samples, TrainerError};
use augsim_data::random_stream;
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Effective share of the particles below which they are resampled and moved.
const ENOUGH: f64 = 0.5;
/// Effective share of the particles that one tempering step must leave.
const DEGREE: f64 = 0.25;
/// Metropolis steps of every particle after a resampling.
const MOVES: usize = 2;
/// Size of a move: a preconditioned Crank-Nicolson step keeps sqrt(1 - MOVE_SIZE^2) of the old value.
const MOVE: f64 = 0.7;
/// Maximum number of tempering steps of one row.
/// Each step narrows the posterior at least fourfold, so only a row that no particle explains needs more.
const MOST_DEGREES: usize = 40;

/// Largest difference of the particles' states that still counts as equal, in standard deviations.
/// The transition model's own resolution replaces it where that is larger. As long as the states are equal
/// in this sense, the observed rows carry no information about the latents. Without the resolution the
/// small errors of a net along a smooth flight, the same from row to row, were taken for information: after
/// 55 exact rows of a falling ball the 90 % band held 82 %.
const ALIKE: f64 = 0.1;

/// A particle filter of one trajectory.
/// Two filters with the same transition model, seed and rows give identical bytes.
pub struct Filter<'m> {
    law: Box<dyn StepLaw + 'm>,
    sensor: Sensor,
    start: StartLaw,
    actions: &'m [f64],
    width: usize,
    rng: Xoshiro256PlusPlus,
    stream: (u64, u64),
    count: usize,
    /// Observed rows, `[t, S]`.
    rows: Vec<f64>,
    /// Latents of the particles, `[n, L]`.
    latents: Vec<f64>,
    states: States,
    /// Log weights of the particles, `[n]`.
    weights: Vec<f64>,
    /// Log density of the rows observed after those of `shared_state`, `[n]`.
    prefix: Vec<f64>,
    /// Number of leading rows after which all particles had one state, and that state.
    /// These rows are not replayed when latents are moved.
    alike: (usize, Gaussian),
    /// Whether all particles still have one state.
    is_alike: bool,
    /// Whether the latents include the initial state.
    has_starts: bool,
    workspace: Workspace,
    scratch: Scratch,
    samples: Samples,
}

/// Number of rows for which memory is reserved; more rows allocate again.
const ROOM: usize = 4096;

/// Buffers for a row, a move and a forecast; nothing is allocated once each has been used.
#[derive(Debug, Clone, Default)]
struct Scratch {
    next: States,
    replayed: States,
    proposed: Vec<f64>,
    kept: Vec<f64>,
    odds: Vec<f64>,
    density: Vec<f64>,
    prefix: Vec<f64>,
    now: Vec<f64>,
    then: Vec<f64>,
    shares: Vec<f64>,
    chosen: Vec<usize>,
    cloud: Gaussian,
    factor: Vec<f64>,
    white: Vec<f64>,
    moved: Vec<f64>,
    mean: Vec<f64>,
    variance: Vec<f64>,
}

impl Scratch {
    /// Reserves room for `n` particles with `l` latents and `s` state columns.
    /// Without it the first resampling, at an impact, would take longer than the later ones.
    fn with_room(n: usize, l: usize, s: usize) -> Self {
        let (room, most) = (|count: usize| Vec::with_capacity(count), l.max(s));
        let states = || States { mean: Vec::with_capacity(n * s), covariance: Vec::with_capacity(n * s * s) };
        Scratch {
            next: states(),
            replayed: states(),
            proposed: room(n * l),
            kept: room(n * most),
            odds: room(n),
            density: room(n),
            prefix: room(n),
            now: room(n),
            then: room(n),
            shares: room(n),
            chosen: Vec::with_capacity(n),
            cloud: Gaussian { mean: room(most), covariance: room(most * most) },
            factor: room(most * most),
            white: room(most),
            moved: room(most),
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
    /// A filter of `particles` particles before any row.
    /// `actions [T, A]` are known in advance and `width` is A; `stream` holds the seed and the index of the
    /// trajectory in its set.
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
            has_starts: false,
            workspace: Workspace::default(),
            scratch: Scratch::with_room(count, law.latent_dim(), law.state_dim()),
            samples: Samples { count: 0, values: Vec::new() },
            rows: Vec::with_capacity(ROOM * law.state_dim()),
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

    /// Number of rows observed so far.
    pub fn seen(&self) -> usize {
        self.rows.len() / self.law.state_dim()
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
            let first = self.first_state(row);
            self.is_alike = !self.law.begin(&first.mean, &first.covariance);
            self.has_starts = !self.is_alike;
            self.alike = (1, first);
            let mut states = std::mem::take(&mut self.states);
            self.begin_at(&self.latents, &mut states);
            self.states = states;
            return Ok(());
        }
        // The scratch buffers are put back after the call, also when it fails.
        let mut scratch = std::mem::take(&mut self.scratch);
        let done = self.take_in(row, &mut scratch);
        self.scratch = scratch;
        done
    }

    fn take_in(&mut self, row: &[f64], scratch: &mut Scratch) -> Result<(), TrainerError> {
        let enough = ENOUGH * self.count as f64;
        if effective_of(self.weights.iter().copied(), &mut scratch.shares) < enough {
            self.resample(scratch);
            for _ in 0..MOVES {
                self.rejuvenate(None, scratch)?;
            }
        }
        let t = self.seen();
        let mut taken = 0.0;
        for degree in 1.. {
            scratch.next.copy_from(&self.states);
            zeros(&mut scratch.density, self.count);
            let actions = actions(self.actions, self.width, t);
            let seen = (row, &self.sensor);
            let (next, density) = (&mut scratch.next, &mut scratch.density);
            self.workspace.step(&mut *self.law, &self.latents, next, actions, seen, density)?;
            let rest = 1.0 - taken;
            let part = match degree < MOST_DEGREES {
                true => self.degree(&scratch.density, rest, &mut scratch.shares),
                false => rest,
            };
            self.weights.iter_mut().zip(&scratch.density).for_each(|(w, d)| *w += part * d);
            taken += part;
            if part == rest {
                std::mem::swap(&mut self.states, &mut scratch.next);
                self.prefix.iter_mut().zip(&scratch.density).for_each(|(p, d)| *p += d);
                self.rows.extend_from_slice(row);
                if degree == 1 {
                    self.look_alike(scratch);
                } else {
                    self.is_alike = false;
                }
                return Ok(());
            }
            self.resample(scratch);
            for _ in 0..MOVES {
                self.rejuvenate(Some((row, taken)), scratch)?;
            }
        }
        Ok(())
    }

    fn check(&self, row: &[f64]) -> Result<(), TrainerError> {
        let (expected, t) = (self.law.state_dim(), self.seen());
        let rows = self.actions.len().checked_div(self.width).unwrap_or(usize::MAX);
        if row.len() != expected || t >= rows {
            return Err(TrainerError::Row { row: t, expected, found: row.len(), rows });
        }
        match self.sensor.seen().find(|(j, _)| !row[*j].is_finite()) {
            Some((column, _)) => Err(TrainerError::Unseen { row: t, column }),
            None => Ok(()),
        }
    }

    /// Draws `samples` continuations of `horizon` rows after the last observed row, `[horizon, S, sample]`.
    ///
    /// # Errors
    /// [`TrainerError`] if the transition model cannot be evaluated, no row was observed, or the actions
    /// end before the horizon.
    pub fn forecast(&mut self, horizon: usize, samples: usize) -> Result<&Samples, TrainerError> {
        if self.seen() == 0 {
            return Err(TrainerError::NoTrajectories { what: "the prefix" });
        }
        let (row, s) = (self.seen() + horizon, self.law.state_dim());
        if self.width > 0 && row * self.width > self.actions.len() {
            let rows = self.actions.len() / self.width;
            return Err(TrainerError::Row { row: row - 1, expected: s, found: s, rows });
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        let done = self.draw(horizon, samples, &mut scratch);
        self.scratch = scratch;
        done?;
        Ok(&self.samples)
    }

    fn draw(&mut self, horizon: usize, samples: usize, scratch: &mut Scratch) -> Result<(), TrainerError> {
        let (l, s, t) = (self.law.latent_dim(), self.law.state_dim(), self.seen());
        // A separate random stream, so that forecasting now does not change what is inferred from later
        // rows.
        let mut rng = random_stream(self.stream.0 ^ t as u64, "filtered-forecast", self.stream.1);
        let Scratch { next, proposed: latents, shares, chosen, factor, moved: draws, mean, variance, .. } =
            scratch;
        systematic_into(&self.weights, samples, &mut rng, shares, chosen);
        // Shuffled, because the first ten samples must represent all of them (the paper's score is the mean
        // of ten).
        chosen.shuffle(&mut rng);
        next.select_from(&self.states, chosen, s);
        gather_rows(&self.latents, chosen, l, latents);
        zeros(factor, s * s);
        let States { mean: now, covariance } = next;
        for (x, covariance) in now.chunks_exact_mut(s).zip(covariance.chunks_exact(s * s)) {
            cholesky_into(covariance, s, factor);
            draws.clear();
            draws.extend((0..s).map(|_| -> f64 { StandardNormal.sample(&mut rng) }));
            for (j, x) in x.iter_mut().enumerate() {
                *x += (0..=j).map(|k| factor[j * s + k] * draws[k]).sum::<f64>();
            }
        }
        zeros(mean, samples * s);
        zeros(variance, samples * s);
        let values = &mut self.samples.values;
        values.clear();
        values.resize(horizon * s * samples, 0.0);
        self.samples.count = samples;
        for step in 0..horizon {
            let actions = actions(self.actions, self.width, t + step);
            self.law.advance(now, latents, actions, Moments { mean, variance })?;
            for (sample, x) in now.chunks_exact_mut(s).enumerate() {
                for (j, x) in x.iter_mut().enumerate() {
                    let (at, draw): (usize, f64) = (sample * s + j, StandardNormal.sample(&mut rng));
                    *x = mean[at] + variance[at].sqrt() * draw;
                    values[(step * s + j) * samples + sample] = *x as f32;
                }
            }
        }
        Ok(())
    }

    /// The initial state: its prior, updated by the first row.
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

    /// Replaces the particles' states by their mean while they are equal, and resets the weights.
    /// The rows observed so far then carry no information about the latents and need no replay.
    fn look_alike(&mut self, scratch: &mut Scratch) {
        let (n, s) = (self.count, self.law.state_dim());
        let Scratch { cloud, factor: covariance, .. } = scratch;
        weighted_into(&self.states.mean, |_| 1.0, n as f64, s, cloud);
        zeros(covariance, s * s);
        for one in self.states.covariance.chunks_exact(s * s) {
            covariance.iter_mut().zip(one).for_each(|(sum, v)| *sum += v / n as f64);
        }
        let differ = |j: usize| {
            let limit = (ALIKE * ALIKE * covariance[j * s + j]).max(self.law.resolution(j).powi(2));
            self.states.mean.iter().skip(j).step_by(s).any(|m| (m - cloud.mean[j]).powi(2) > limit)
        };
        self.is_alike &= !(0..s).any(differ);
        if self.is_alike {
            self.alike.0 = self.seen();
            self.alike.1.mean.copy_from_slice(&cloud.mean);
            self.alike.1.covariance.copy_from_slice(covariance);
            self.states.repeat(&self.alike.1, self.count);
            self.weights.fill(0.0);
            self.prefix.fill(0.0);
        }
    }

    /// The largest tempering increment, at most `remaining`, that leaves enough effective particles.
    /// Found by bisection.
    fn degree(&self, density: &[f64], rest: f64, shares: &mut Vec<f64>) -> f64 {
        let mut after =
            |part: f64| effective_of(self.weights.iter().zip(density).map(|(w, d)| w + part * d), shares);
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

    /// Resamples the particles in proportion to their weights and makes all weights equal.
    fn resample(&mut self, scratch: &mut Scratch) {
        self.is_alike = false;
        let (l, s) = (self.law.latent_dim(), self.law.state_dim());
        let Scratch { next, kept, shares, chosen, .. } = scratch;
        systematic_into(&self.weights, self.count, &mut self.rng, shares, chosen);
        next.select_from(&self.states, chosen, s);
        std::mem::swap(&mut self.states, next);
        gather_rows(&self.latents, chosen, l, kept);
        std::mem::swap(&mut self.latents, kept);
        gather_rows(&self.prefix, chosen, 1, kept);
        self.prefix.copy_from_slice(kept);
        self.weights.fill(0.0);
    }

    /// Makes one Metropolis step of every latent, invariant under its posterior given the observed rows.
    /// `partial` is a row that is being assimilated, with the tempering exponent reached so far. Proposals
    /// are preconditioned Crank-Nicolson steps (Cotter et al. 2013) about the particles' own mean and
    /// covariance.
    fn rejuvenate(
        &mut self,
        partial: Option<(&[f64], f64)>,
        scratch: &mut Scratch,
    ) -> Result<(), TrainerError> {
        let (l, s, n) = (self.law.latent_dim(), self.law.state_dim(), self.count);
        self.propose(scratch);
        self.replay(scratch)?;
        zeros(&mut scratch.now, n);
        zeros(&mut scratch.then, n);
        if let Some((row, part)) = partial {
            let actions = actions(self.actions, self.width, self.seen());
            let Scratch { next, replayed, proposed, now, then, .. } = scratch;
            for (latents, states, density) in
                [(&self.latents, &self.states, now), (&*proposed, &*replayed, then)]
            {
                next.copy_from(states);
                let seen = (row, &self.sensor);
                self.workspace.step(&mut *self.law, latents, next, actions, seen, density)?;
                density.iter_mut().for_each(|d| *d *= part);
            }
        }
        for i in 0..n {
            let at = i * l..(i + 1) * l;
            let proposed = &scratch.proposed[at.clone()];
            let prior = self.law.log_density(proposed) - self.law.log_density(&self.latents[at.clone()]);
            let rows = scratch.prefix[i] - self.prefix[i];
            let ratio = scratch.odds[i] + prior + rows + scratch.then[i] - scratch.now[i];
            let draw: f64 = self.rng.random();
            if draw.ln() < ratio {
                self.latents[at].copy_from_slice(proposed);
                self.states.copy_one(&scratch.replayed, i, s);
                self.prefix[i] = scratch.prefix[i];
            }
        }
        Ok(())
    }

    /// Proposes new latents and computes the logarithms of their proposal ratios.
    fn propose(&mut self, scratch: &mut Scratch) {
        let (l, n) = (self.law.latent_dim(), self.count);
        let Scratch { proposed, odds, cloud, factor, white, moved, .. } = scratch;
        weighted_into(&self.latents, |_| 1.0, n as f64, l, cloud);
        zeros(factor, l * l);
        cholesky_into(&cloud.covariance, l, factor);
        zeros(proposed, n * l);
        zeros(odds, n);
        zeros(white, l);
        zeros(moved, l);
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        for i in 0..n {
            whiten_into(&self.latents[i * l..(i + 1) * l], &cloud.mean, factor, white);
            for (moved, v) in moved.iter_mut().zip(&*white) {
                let draw: f64 = StandardNormal.sample(&mut self.rng);
                *moved = (1.0 - MOVE * MOVE).sqrt() * v + MOVE * draw;
            }
            for j in 0..l {
                let shift: f64 = (0..=j).map(|k| factor[j * l + k] * moved[k]).sum();
                proposed[i * l + j] = cloud.mean[j] + shift;
            }
            odds[i] = 0.5 * (square(moved) - square(white));
        }
    }

    /// Writes the particles' states after the leading rows that carry no information about the latents.
    fn begin_at(&self, latents: &[f64], states: &mut States) {
        states.repeat(&self.alike.1, self.count);
        if self.has_starts {
            let (l, s) = (self.law.latent_dim(), self.law.state_dim());
            let each = latents.chunks_exact(l).zip(states.mean.chunks_exact_mut(s));
            each.for_each(|(latent, state)| self.law.first(latent, state));
            states.covariance.fill(0.0);
        }
    }

    /// Computes states after all observed rows, and the rows' log density, for the proposed latents.
    fn replay(&mut self, scratch: &mut Scratch) -> Result<(), TrainerError> {
        let s = self.law.state_dim();
        let Scratch { replayed, prefix, proposed, .. } = scratch;
        self.begin_at(proposed, replayed);
        zeros(prefix, self.count);
        for t in self.alike.0..self.seen() {
            let actions = actions(self.actions, self.width, t);
            let seen = (&self.rows[t * s..(t + 1) * s], &self.sensor);
            self.workspace.step(&mut *self.law, proposed, replayed, actions, seen, prefix)?;
        }
        Ok(())
    }
}

/// The actions at the samples before and at row `t`.
fn actions(all: &[f64], width: usize, t: usize) -> [&[f64]; 2] {
    [t - 1, t].map(|t| &all[t * width..(t + 1) * width])
}

/// Resizes `values` to `count` zeros.
fn zeros(values: &mut Vec<f64>, count: usize) {
    values.clear();
    values.resize(count, 0.0);
}

#[cfg(test)]
mod tests;
