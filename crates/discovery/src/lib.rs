#![doc = include_str!("../README.md")]

mod addition;
mod answer;
mod arc;
mod assess;
mod calibrate;
mod closed_term;
mod columns;
mod descent;
mod difference_noise;
mod discover;
mod distinguish;
mod error;
mod error_table;
mod estimate;
mod evaluate;
mod event_offsets;
mod examples;
mod experiment;
mod feedback;
mod finite;
mod fit;
mod fit_state;
mod forecast;
mod formulas;
mod frame_clock;
mod free_runs;
mod group_distribution;
mod growing_windows;
mod hypothesis;
mod identifiability;
mod interim;
mod interval;
mod judge;
mod linear;
mod linear_problem;
#[cfg(test)]
mod linear_toy;
mod noise;
mod noise_cause;
mod noise_estimate;
mod noise_verdict;
mod nuisance_fit;
mod options;
mod periodicity;
mod predict;
mod prediction;
mod prepare;
mod random_effect;
mod random_effect_test;
mod record;
mod records;
mod repeat_scatter;
mod replicate_noise;
mod report;
mod resampling;
mod residual_structure;
mod residuals;
mod result;
mod score;
mod search;
mod segments;
mod sentence;
mod single_record;
mod spikes;
mod stages;
mod statistics;
mod theta_step;
mod unknown_inputs;
mod work_counter;

pub use assess::{Assessment, assess};
pub use discover::discover;
pub use error::{DiscoveryError, Groups};
pub use group_distribution::GroupDistribution;
pub use noise_cause::{NoiseCause, NoiseRow, NoiseSource};
pub use options::{AllowedEffects, Observer, Options, Progress};
pub use predict::predict_records;
pub use prediction::{
    PREDICTION_LEVELS, PredictOptions, PredictedChannel, PredictedRecord, PredictionError, PredictionSet,
    quantile_of_draws, rmse_interval, rmse_reduction,
};
pub use repeat_scatter::{RepeatScatter, Repeats};
pub use resampling::{UniformRecord, resample_uniformly};
pub use result::{
    Anatomy, Bin, Candidate, Discovery, ErrorTable, Estimate, Example, ExampleChannel, FoundEffect,
    FoundFormula, FreeRun, Horizon, HorizonErrors, Lead, Models, NoiseFound, NullRecords, Rmse, SCHEMA,
    Tests, Unexplained, Verdict, Windows, Work,
};
