//! Expectations of a model about its data (gravity, noise, columns), for plausibility checks.

use super::{Model, ModelFile, PushModel};
use crate::ball::GRAVITY;
use augsim_data::checks::ExpectedData;

impl Model {
    /// Gravity, sensor noise and columns that a model of the ball expects of its data.
    pub fn expected(&self) -> ExpectedData {
        ExpectedData {
            gravity_m_s2: Some(self.parameters[GRAVITY].nominal),
            position_sd_m: self.position_sd_m,
            // `height_m` is not listed: a file may have the height under both names, and the model reads one
            // of them.
            outputs: names(&["x_m", "y_m", "z_m"]),
            ..ExpectedData::default()
        }
    }
}

impl PushModel {
    /// Sensor noise and columns (object pose, rod position) that a model of pushing expects of its data.
    pub fn expected(&self) -> ExpectedData {
        ExpectedData {
            position_sd_m: self.position_sd_m,
            angle_sd_rad: self.angle_sd_rad,
            outputs: names(&["x_m", "y_m", "theta_rad"]),
            inputs: names(&["pusher_x_m", "pusher_y_m"]),
            ..ExpectedData::default()
        }
    }
}

/// Converts column names to owned strings.
fn names(columns: &[&str]) -> Vec<String> {
    columns.iter().map(|column| (*column).to_owned()).collect()
}

impl ModelFile {
    /// Gravity, sensor noise and columns that the model expects of its data.
    pub fn expected(&self) -> ExpectedData {
        match self {
            ModelFile::Ball(model) => model.expected(),
            ModelFile::Push(model) => model.expected(),
        }
    }
}
