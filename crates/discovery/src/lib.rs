//! Calibration, residuals, structure tests and the search for missing effects.
//!
//! [`discover`] takes a declared model and measured trajectories and says what the model lacks: nothing, effects of the
//! library, or something that the library does not know. Noise is estimated from the data alone; parameters are fitted
//! through the simulator by Levenberg-Marquardt with exact sensitivities and eliminated initial states (Golub and Pereyra
//! 1973); candidates are found by score tests (Rao 1948), chosen by penalised likelihood on training trajectories and
//! confirmed on held-out ones; what is left is tested in families of fixed level; random parameters are integrated out by
//! Laplace's approximation with MacKay's fixed point for its scale.

mod accept;
mod addition;
mod adequacy;
mod anatomy;
mod answer;
mod assess;
mod blocks;
mod calibrate;
mod candidates;
mod cluster;
mod covariance;
mod crossed;
mod deal;
mod decide;
mod discover;
mod dispersion;
mod drawn;
mod error;
mod error_table;
mod evaluate;
mod experiment;
mod explore;
mod fit;
mod folds;
mod forecast;
mod hypothesis;
mod inference;
mod linear;
#[cfg(test)]
mod linear_toy;
mod noise;
mod options;
mod outliers;
mod periodicity;
mod pieces;
mod prepare;
mod record;
mod remainder;
mod report;
mod residuals;
mod result;
mod rough_noise;
mod sample;
mod scan;
mod scattered;
mod score;
mod search;
mod separate;
mod spikes;
mod spread;
mod statistics;
mod structural;
mod tally;
mod unlisted;

pub use assess::{Assessment, assess};
pub use discover::discover;
pub use error::{DiscoveryError, Groups};
pub use options::{Options, Progress};
pub use result::{
    Anatomy, Bin, Candidate, Discovery, ErrorTable, Estimate, FoundEffect, Horizon, HorizonErrors,
    NoiseFound, Rmse, SCHEMA, Tests, Unexplained, Verdict, Windows, Work,
};
