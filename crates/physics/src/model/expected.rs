//! Statements of a model about its data (gravity, sensor noise), for the checks of suspicious data.

use super::{Model, ModelFile, PushModel};
use crate::ball::GRAVITY;
use augsim_data::checks::Expected;

impl Model {
    /// Gravity and the declared sensor noise.
    pub fn expected(&self) -> Expected {
        Expected {
            gravity_m_s2: Some(self.parameters[GRAVITY].nominal),
            position_sd_m: self.position_sd_m,
            angle_sd_rad: None,
        }
    }
}

impl PushModel {
    /// The declared sensor noise.
    pub fn expected(&self) -> Expected {
        Expected { gravity_m_s2: None, position_sd_m: self.position_sd_m, angle_sd_rad: self.angle_sd_rad }
    }
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
