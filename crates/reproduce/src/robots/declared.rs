//! An arm as `reproduce robots` declares it: description, log, and how a model is made from both.

use super::published::Published;
use augsim_data::Dataset;
use augsim_session::robot::{Free, RobotRequest};

/// An arm that is declared from its files.
#[derive(Debug)]
pub struct Declared {
    /// Text of the description file.
    pub description: String,
    /// Name of the description file beside the model file.
    pub file: &'static str,
    /// Log of the joints.
    pub log: Dataset,
    /// How a model is made from both.
    pub request: RobotRequest,
    /// Published values, or true ones of a simulated arm.
    pub published: Vec<Published>,
}

/// Request of a model in the formulation that the log allows, with the gravity of the description.
pub fn request(file: &str, log: &str, free: Free) -> RobotRequest {
    RobotRequest {
        joints: Vec::new(),
        positions: Vec::new(),
        torques: Vec::new(),
        formulation: None,
        gravity: None,
        free,
        file: file.to_owned(),
        log: log.to_owned(),
    }
}
