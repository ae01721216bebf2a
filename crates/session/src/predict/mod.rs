//! Predicts trajectories by a model or net, with prediction bands.

mod draws;
mod equations;
mod measure_scores;
mod net;
mod parameter_uncertainty;
mod process_noise;
mod scores;
pub mod table;

pub use draws::RecordDraws;
pub use measure_scores::{MeasureScores, fit_percent, measure_scores};
pub use net::{NetAndPhysics, net_and_physics, net_scores, predict_with_net};
pub use scores::{OutputScores, scores};

use crate::usage::Takes;
use crate::{DataFrom, Subject, Usage};
use augsim_data::MissingCells;
use augsim_discovery::{PredictOptions, PredictionSet};

/// Default number of predictive draws per trajectory.
///
/// The ends of 90 % bands then have an error of a few per cent of the band width.
pub const DRAWS: usize = 400;

/// Maximum number of predictive draws per trajectory.
///
/// The share of values outside a 90 % band then has a standard error of sqrt(0.1 * 0.9 / 100,000) = 0.1 %, far
/// below what the model's own error adds; more draws only take time and memory.
pub const MAX_DRAWS: usize = 100_000;

/// Checks that a number of predictive draws is at most [`MAX_DRAWS`].
pub(crate) fn check_draws(draws: usize) -> Result<(), Usage> {
    match draws > MAX_DRAWS {
        true => Err(Usage::option("--samples", draws, Takes::AtMost { most: MAX_DRAWS })),
        false => Ok(()),
    }
}

/// Predicts every trajectory of `data`, with prediction bands.
///
/// Initial states of equation models are fitted to the first `burn_in` samples.
///
/// # Errors
/// The data do not fit the model, or cannot be read; there are more than [`MAX_DRAWS`] draws.
pub fn predict(
    model: &Subject,
    data: &DataFrom,
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<PredictionSet> {
    check_draws(options.draws)?;
    Ok(match model {
        Subject::Equations(model) => equations::predict(model, data, burn_in, options)?,
        Subject::BuiltIn(model) => {
            let set = data.read(MissingCells::AsGap)?;
            augsim_discovery::predict_records(model.declaration(), &set, options)?
        }
    })
}
