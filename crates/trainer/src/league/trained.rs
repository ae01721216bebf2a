//! What the forecasts of a trained class need besides its net.

use crate::scales::Scales;
use crate::settings::Settings;
use augsim_nn::Params;

/// Settings, scales and parameters of a trained class, which its forecasts need besides its net.
#[derive(Debug, Clone, Copy)]
pub struct Trained<'a> {
    pub settings: &'a Settings,
    pub scales: &'a Scales,
    pub params: &'a Params<f32>,
}

impl Trained<'_> {
    /// Parameter values in double precision, in the order in which they were registered.
    pub(super) fn values(&self) -> Vec<f64> {
        self.params.values().iter().map(|v| f64::from(*v)).collect()
    }
}
