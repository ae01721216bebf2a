//! A trained class.

use crate::scales::Scales;
use crate::settings::Settings;
use augsim_nn::Params;

/// A trained class, as its forecasts need it.
#[derive(Debug, Clone, Copy)]
pub struct Trained<'a> {
    pub settings: &'a Settings,
    pub scales: &'a Scales,
    pub params: &'a Params<f32>,
}
