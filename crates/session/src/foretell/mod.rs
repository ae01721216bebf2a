//! Forecasts of a model as it stands, with bands.

mod drawn;
mod net;
mod pushes;
mod scored;
pub mod table;
mod written;

pub use drawn::Drawn;
pub use net::{Beside, beside, foretell_net, net_scores};
pub use scored::{ScoredRow, scored};

use crate::{DataFrom, Subject};
use augsim_data::MissingCells;
use augsim_discovery::{ForetellOptions, Foretelling};

/// Draws of each trajectory where none are asked for: the ends of 90 % bands are then good to a few per cent of their width.
pub const DRAWS: usize = 400;

/// Forecasts every trajectory of `data`. Starts of equations are fitted to the first `burn_in` samples.
///
/// # Errors
/// Model and data do not go together, or the data cannot be read.
pub fn foretell(
    model: &Subject,
    data: &DataFrom,
    burn_in: usize,
    options: &ForetellOptions,
) -> anyhow::Result<Foretelling> {
    Ok(match model {
        Subject::Written(model) => written::foretell(model, data, burn_in, options)?,
        Subject::BuiltIn(model) => {
            let set = data.read(MissingCells::AsGap)?;
            augsim_discovery::foretell(model.declaration(), &set, options)?
        }
    })
}
