#![doc = include_str!("../README.md")]

mod accept;
mod addition;
mod anatomy;
mod answer;
mod arc;
mod assess;
mod calibrate;
mod chosen_records;
mod clocked;
mod closed_term;
mod columns;
mod cut;
mod descent;
mod discover;
mod drawn;
mod error;
mod error_table;
mod evaluate;
mod examples;
mod experiment;
mod fit;
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
mod interval;
mod judge;
mod linear;
#[cfg(test)]
mod linear_toy;
mod lone;
mod noise;
mod noise_cause;
mod offsets;
mod options;
mod outliers;
mod periodicity;
mod pieces;
mod prepare;
mod record;
mod records;
mod report;
mod residuals;
mod result;
mod rough_noise;
mod scattered;
mod score;
mod search;
mod sentence;
mod separate;
mod spikes;
mod spread;
mod stages;
mod state;
mod statistics;
mod tally;
mod theta_step;
mod undetermined;

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
    FoundFormula, FreeRun, Horizon, HorizonErrors, Lead, Models, NoiseFound, NullRecords, Rmse, SCHEMA,
    Tests, Unexplained, Verdict, Windows, Work,
};
