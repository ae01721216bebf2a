#![doc = include_str!("../README.md")]

mod accept;
mod addition;
mod adequacy;
mod anatomy;
mod answer;
mod arc;
mod assess;
mod blocks;
mod calibrate;
mod candidates;
mod chosen_records;
mod clocked;
mod cluster;
mod confirmation;
mod covariance;
mod crossed;
mod cut;
mod deal;
mod decide;
mod descent;
mod discover;
mod dispersion;
mod doubt;
mod drawn;
mod end_of_sensor;
mod error;
mod error_table;
mod evaluate;
mod examples;
mod experiment;
mod explore;
mod fit;
mod folded;
mod folds;
mod follow;
mod forecast;
mod foretell;
mod foretold;
mod formulas;
mod framed;
mod free_runs;
mod grammar;
mod grown;
mod hypothesis;
mod inference;
mod interval;
mod judged;
mod likeliest;
mod linear;
#[cfg(test)]
mod linear_toy;
mod lone;
mod long_search;
mod longer;
mod noise;
mod noise_cause;
mod offsets;
mod options;
mod outliers;
mod pairs;
mod part;
mod periodicity;
mod pieces;
mod prepare;
mod record;
mod remainder;
mod report;
mod residuals;
mod result;
mod rough_noise;
mod scan;
mod scattered;
mod score;
mod scored;
mod search;
mod sentence;
mod separate;
mod shaken;
mod sound;
mod spikes;
mod spread;
mod state;
mod statistics;
mod structural;
mod supported;
mod tables;
mod tally;
mod theta_step;
mod trapped;
mod unlisted;

pub use assess::{Assessment, assess};
pub use clocked::{Clocked, on_a_clock};
pub use discover::discover;
pub use error::{DiscoveryError, Groups};
pub use foretell::foretell;
pub use foretold::{
    FORETOLD_LEVELS, ForetellOptions, Foretelling, Foretold, ForetoldChannel, ForetoldError,
    interval_of_rmse, quantile_of_draws, reduction_of_rmse,
};
pub use noise_cause::{NoiseCause, NoiseRow, ShakenBy};
pub use options::{Options, Progress};
pub use result::{
    Anatomy, Bin, Candidate, Discovery, ErrorTable, Estimate, Example, ExampleChannel, FoundEffect,
    FoundFormula, FreeRun, Horizon, HorizonErrors, Models, NoiseFound, Rmse, SCHEMA, Tests, Unexplained,
    Verdict, Windows, Work,
};
