//! The model classes of the paper, their training, and honest evaluation.
//!
//! [`Training`] trains the net of a [`Recipe`] on [`Sequences`]; a [`Forecaster`] gives trajectories from
//! the first state and the actions alone; [`evaluate_forecast`] and [`evaluate_reconstruction`] score them under a named
//! [`Protocol`].

mod ball_model;
mod engine;
mod error;
mod evaluate;
mod forecast;
mod latent;
pub mod models;
pub mod nets;
mod noise;
mod prepare;
pub mod push;
pub mod score;
mod sequences;
mod settings;
mod tiles;
mod training;

pub use ball_model::{BallModelError, ModelBall};
pub use engine::{Engine, EngineSpec};
pub use error::TrainerError;
pub use evaluate::{Protocol, SAMPLES, evaluate_forecast, evaluate_reconstruction};
pub use forecast::{Forecaster, Samples, Task};
pub use latent::LatentLaw;
pub use models::NetModel;
pub use prepare::{Fitted, Scales};
pub use sequences::{Sequence, Sequences};
pub use settings::{NetSettings, Recipe, Settings};
pub use training::{Losses, Training, TrainingState};

/// Trajectories per batch tile: the f32 lanes of the widest vector.
pub const TILE: usize = 16;
