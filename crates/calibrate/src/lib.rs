#![doc = include_str!("../README.md")]

mod growth;
mod minima;
mod normal;
mod outcome;
mod starts;
mod steps;
mod windows;

pub use growth::calibrate;
pub use outcome::{Calibration, CalibrationError, Gauge, Stage};
pub use starts::{Begun, fit_start};
