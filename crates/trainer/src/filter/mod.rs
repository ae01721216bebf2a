//! Filtered forecasts: the beginning of a trajectory is seen, the rest is forecast.
//!
//! A quantity that differs from trajectory to trajectory (the latent of Hybrid+, a restitution that scatters) is a particle; the state,
//! given a particle, is Gaussian and follows in closed form (a Rao-Blackwellised particle filter: Doucet, de Freitas,
//! Murphy, Russell 2000). A [`StepLaw`] says how a state moves on; a [`Sensor`] what is seen of it; [`Filter`] takes one row
//! after another and forecasts from there. It never sees a later row. Particles are moved where they are few, and no encoder
//! proposes them: with 64, 256 and 2,048 particles Hybrid+ forecasts the paper's drops alike, so that none are missing where they
//! should be.
//!
//! A system that is simulated as a whole (a model file) is seen through [`SystemFilter`]: the unknowns of a trajectory are its
//! start, the parameters of its own and the offsets of its events, and their posterior is sampled. [`PrefixForecaster`] is the
//! one trait of both.

mod behind;
mod case;
mod conditioned;
mod corrected;
mod engine;
mod evaluate;
mod forecast_net;
mod kept;
mod least_squares;
mod mixture;
mod mode;
mod moments;
mod net;
mod own;
mod particles;
mod posterior;
mod remainder;
mod restitution;
mod score;
mod sensor;
mod started;
mod system;
mod weights;
mod widened;

pub use behind::{FilterSettings, Prefix, PrefixForecaster};
pub use conditioned::Conditioned;
pub use corrected::{Corrected, ForecastCorrection};
pub use engine::EngineLaw;
pub use evaluate::{behind_rows, evaluate_filtered, seen_rows};
pub use kept::Kept;
pub use least_squares::{FittedDrop, Freedom};
pub use mixture::Filter;
pub use net::NetLaw;
pub use own::OwnLaws;
pub use remainder::Remembered;
pub use restitution::RestitutionLaw;
pub use score::FilteredScore;
pub use sensor::{Sensor, StartLaw};
pub use system::SystemFilter;
pub use widened::Widened;

use crate::TrainerError;
use rand_xoshiro::Xoshiro256PlusPlus;

/// How states move on by one sample, given what differs from trajectory to trajectory.
pub trait StepLaw {
    /// Width of what differs from trajectory to trajectory.
    fn latent_dim(&self) -> usize;

    /// State columns.
    fn state_dim(&self) -> usize;

    /// Draws `count` latents, `[count, L]`, from their law over trajectories.
    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64>;

    /// Logarithm of the density of a latent, less a constant.
    fn log_density(&mut self, latent: &[f64]) -> f64;

    /// How closely the law follows column `j`, in its unit: no measurement counts as better than that, because the law's errors
    /// over many rows are not independent and would be read as evidence.
    fn resolution(&self, _j: usize) -> f64 {
        0.0
    }

    /// Takes the law of the first state, corrected by the first row; true where the first state is a part of the latents.
    fn begin(&mut self, _mean: &[f64], _covariance: &[f64]) -> bool {
        false
    }

    /// The first state of a latent, where it is a part of it.
    fn first(&self, _latent: &[f64], _state: &mut [f64]) {}

    /// Means and variances `[lane, S]` of the next states for `states [lane, S]` and `latents [lane, L]`, while the actions go
    /// from `from` to `to`.
    ///
    /// # Errors
    /// [`TrainerError`] if the law cannot be evaluated.
    fn advance(
        &mut self,
        states: &[f64],
        latents: &[f64],
        actions: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError>;
}

/// Where a [`StepLaw`] writes the next states, `[lane, S]` each.
#[derive(Debug)]
pub struct Moments<'a> {
    /// Means.
    pub mean: &'a mut [f64],
    /// Variances of what the step adds at random.
    pub variance: &'a mut [f64],
}
