//! Forecasts of a trajectory after its first rows were observed.
//!
//! A quantity that differs from trajectory to trajectory (the latent of Hybrid+, a random restitution) is
//! represented by particles; the state given a particle is Gaussian and is propagated by cubature (a
//! Rao-Blackwellised particle filter: Doucet, de Freitas, Murphy, Russell 2000). A [`TransitionModel`]
//! moves a state on by one sample; a [`Sensor`] describes the measurements; [`Filter`] assimilates one row
//! after another and forecasts from there. It has no access to later rows. Where few particles are
//! effective they are resampled and moved; no encoder proposes them. With 64, 256 and 2,048 particles
//! Hybrid+ forecasts the paper's drops equally well, so the number of particles does not limit it.
//!
//! A system that is simulated as a whole (a model file) is treated by [`SystemFilter`]: the unknowns of a
//! trajectory are its initial state, its own parameters and the offsets of its events, and their posterior
//! is sampled. [`PrefixForecaster`] is the trait of all these forecasters.

mod conditioned;
mod engine;
mod evaluate;
mod forecast_cache;
mod forecast_correction;
mod forecast_net;
mod inference_problem;
mod initial_state_latents;
mod learned_priors;
mod least_squares;
mod mode;
mod moments;
mod net;
mod particle_filter;
mod particles;
mod posterior;
mod prefix;
mod rescaled_spread;
mod restitution;
mod score;
mod sensor;
mod system;
mod trajectory_regression;
mod weights;

pub use conditioned::ConditionedForecaster;
pub use engine::EngineTransition;
pub use evaluate::{evaluate_filtered, measured_rows, same_prefix_lengths};
pub use forecast_cache::CachedForecasts;
pub use forecast_correction::{CorrectedForecaster, ForecastCorrection};
pub use learned_priors::LearnedPriors;
pub use least_squares::{FittedDrop, FreeParameters};
pub use net::NetTransition;
pub use particle_filter::Filter;
pub use prefix::{FilterSettings, Prefix, PrefixForecaster};
pub use rescaled_spread::RescaledSpread;
pub use restitution::RandomRestitution;
pub use score::FilteredScore;
pub use sensor::{InitialStatePrior, Sensor};
pub use system::SystemFilter;
pub use trajectory_regression::TrajectoryRegression;

use crate::TrainerError;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A probabilistic model of one sample step, given the latents of a trajectory.
pub trait TransitionModel {
    /// Number L of latent variables of a trajectory.
    fn latent_dim(&self) -> usize;

    /// Number S of state columns.
    fn state_dim(&self) -> usize;

    /// Draws `count` latents `[count, L]` of L values each from their prior.
    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64>;

    /// Log prior density of a latent, up to a constant.
    fn log_density(&mut self, latent: &[f64]) -> f64;

    /// Accuracy of the model's steps in state column `j`, in the column's unit.
    /// Measurements count as no more accurate than this: the model's errors over many rows are not
    /// independent and would otherwise be taken for information about the latents.
    fn resolution(&self, _j: usize) -> f64 {
        0.0
    }

    /// Sets the distribution of the initial state, updated by the first row.
    /// Returns true if the initial state is part of the latents.
    fn set_initial_state(&mut self, _mean: &[f64], _covariance: &[f64]) -> bool {
        false
    }

    /// Writes the initial state that a latent determines; only called where the latents include it.
    fn initial_state(&self, _latent: &[f64], _state: &mut [f64]) {}

    /// Computes means and variances `[lane, S]` of the next states.
    /// The states are `states [lane, S]` with `latents [lane, L]`, while the actions go from `from` to
    /// `to`.
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be evaluated.
    fn advance(
        &mut self,
        states: &[f64],
        latents: &[f64],
        actions: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError>;
}

/// Output buffers for mean and variance of the next states, `[lane, S]` each.
#[derive(Debug)]
pub struct Moments<'a> {
    /// Means of the next states.
    pub mean: &'a mut [f64],
    /// Variances of the step's process noise.
    pub variance: &'a mut [f64],
}
