#![doc = include_str!("../README.md")]

mod collect_in_order;
mod difference;
mod engine;
mod error;
mod evaluate;
mod featuriser;
pub mod filter;
mod forecast;
mod latent;
mod league;
mod least_squares;
pub mod models;
pub mod nets;
mod noise;
mod prepared;
pub mod push;
mod rates;
mod recipe;
mod scales;
pub mod score;
mod sequences;
mod settings;
mod stepper;
mod steps;
mod tiles;
mod training;
mod violations;

pub use collect_in_order::collect_in_order;
pub use difference::Difference;
pub use engine::{Engine, EngineError, EquationEngine, SystemEngine, ThrowAxes, ThrowEngine};
pub use error::TrainerError;
pub use evaluate::{
    Protocol, SAMPLES, check_finite, evaluate_forecast, evaluate_reconstruction, forecast_scores,
};
pub use forecast::{Forecaster, Samples, Task};
pub use latent::LatentDistribution;
pub use models::NetModel;
pub use rates::CorrectionShrinkage;
pub use recipe::Recipe;
pub use scales::Scales;
pub use sequences::{Sequence, Sequences};
pub use settings::{Correction, NetSettings, Settings};
pub use stepper::{Next, Stepper};
pub use training::{Losses, Training, TrainingState};
pub use violations::{Violations, violations};

/// Trajectories per batch tile: the number of f32 lanes in the widest SIMD register (AVX-512).
pub const TILE: usize = 16;
