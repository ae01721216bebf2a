//! Predictions of a model or net with bands.

mod draws;
mod equations;
mod net;
mod parameter_uncertainty;
mod process_noise;
mod scores;
pub mod table;

pub use draws::RecordDraws;
pub use net::{NetAndPhysics, net_and_physics, net_scores, predict_with_net};
pub use scores::{OutputScores, scores};

use crate::{DataFrom, Subject};
use augsim_data::MissingCells;
use augsim_discovery::{PredictOptions, PredictionSet};

/// Default number of draws per trajectory.
///
/// The ends of 90 % bands then have an error of a few per cent of the band width.
pub const DRAWS: usize = 400;

/// Predicts every trajectory of `data`.
///
/// Initial states of equation models are fitted to the first `burn_in` samples.
///
/// # Errors
/// The data do not fit the model, or cannot be read.
pub fn predict(
    model: &Subject,
    data: &DataFrom,
    burn_in: usize,
    options: &PredictOptions,
) -> anyhow::Result<PredictionSet> {
    Ok(match model {
        Subject::Equations(model) => equations::predict(model, data, burn_in, options)?,
        Subject::BuiltIn(model) => {
            let set = data.read(MissingCells::AsGap)?;
            augsim_discovery::predict_records(model.declaration(), &set, options)?
        }
    })
}
