#![doc = include_str!("../README.md")]

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
mod confirmation;
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
mod push;
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
pub use push::{assess_push, discover_push};
pub use result::{
    Anatomy, Bin, Candidate, Discovery, ErrorTable, Estimate, FoundEffect, Horizon, HorizonErrors,
    NoiseFound, PushFound, PushHorizon, Rmse, SCHEMA, Tests, Unexplained, Verdict, Windows, Work,
};
