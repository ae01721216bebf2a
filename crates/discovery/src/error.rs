//! Why a discovery cannot be made.

use thiserror::Error;

/// Data or a model with which the loop cannot be closed. Every message says what to do.
#[derive(Debug, Error)]
pub enum DiscoveryError {
    /// None of the known position columns.
    #[error(
        "{data}: no position columns; 1-D data need `height_m`, 2-D `x_m` and `z_m`, 3-D `x_m`, `y_m` and `z_m`"
    )]
    NoPosition {
        /// The data.
        data: String,
    },
    /// Too few trajectories to hold some out.
    #[error(
        "{data}: {found} trajectory with enough samples; at least 2 are needed, because the gain is judged on trajectories that the fit has not seen"
    )]
    TooFew {
        /// The data.
        data: String,
        /// How many there are.
        found: usize,
    },
    /// A position that never changes.
    #[error(
        "{data}: the column `{column}` never changes, so the ball is not moving in it; check the column or remove it"
    )]
    Constant {
        /// The data.
        data: String,
        /// The column.
        column: String,
    },
    /// Restitution is to be calibrated without impacts.
    #[error(
        "{data}: no impacts found, so `restitution` cannot be calibrated; freeze it or remove it from {model}, or give data with bounces"
    )]
    NoImpacts {
        /// The data.
        data: String,
        /// The model.
        model: String,
    },
    /// The declared model cannot be brought near the data.
    #[error(
        "{model} cannot be calibrated to {data}: gravity with a free start leaves {rmse_m} m in the first flights, {ratio} times the sensor's noise of {sd_m} m; check units, the sign of the height (up is positive), the contact height (0) and `t_s` (0 at the release)"
    )]
    NotCalibrated {
        /// The model.
        model: String,
        /// The data.
        data: String,
        /// Root mean square residual, m.
        rmse_m: String,
        /// Noise, m.
        sd_m: String,
        /// Their ratio.
        ratio: String,
    },
    /// Velocities or positions that cannot be compared.
    #[error("{0}")]
    Data(#[from] augsim_data::DataError),
}
