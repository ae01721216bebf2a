//! Statements of a model about its data (gravity, sensor noise, columns), for the checks of suspicious data.

use super::{Model, ModelFile, PushModel};
use crate::ball::GRAVITY;
use augsim_data::checks::Expected;

impl Model {
    /// Gravity, the declared sensor noise, and the coordinates.
    pub fn expected(&self) -> Expected {
        Expected {
            gravity_m_s2: Some(self.parameters[GRAVITY].nominal),
            position_sd_m: self.position_sd_m,
            // A file may have the height under both names, `height_m` and `z_m`: the model reads one of them.
            outputs: names(&["x_m", "y_m", "z_m"]),
            ..Expected::default()
        }
    }
}

impl PushModel {
    /// The declared sensor noise, the pose of the object, and the position of the rod.
    pub fn expected(&self) -> Expected {
        Expected {
            position_sd_m: self.position_sd_m,
            angle_sd_rad: self.angle_sd_rad,
            outputs: names(&["x_m", "y_m", "theta_rad"]),
            inputs: names(&["pusher_x_m", "pusher_y_m"]),
            ..Expected::default()
        }
    }
}

fn names(columns: &[&str]) -> Vec<String> {
    columns.iter().map(|column| (*column).to_owned()).collect()
}

impl ModelFile {
    /// The statements of this model about its data.
    pub fn expected(&self) -> Expected {
        match self {
            ModelFile::Ball(model) => model.expected(),
            ModelFile::Push(model) => model.expected(),
        }
    }
}
