//! Ball and pushing engines, effects, sensor models and model files.

pub mod ball;
