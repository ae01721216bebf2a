#![doc = include_str!("../README.md")]

mod along;
mod growth;
mod kalman;
mod lengths;
mod minima;
mod normal;
mod outcome;
mod shaken;
mod smooth;
mod starts;
mod steps;
mod variances;
mod windows;

pub use growth::calibrate;
pub use outcome::{Calibration, CalibrationError, Gauge, Stage};
pub use shaken::{FitIfShaken, Fitted, Known, Pushed, Readings, fit_if_shaken};
pub use smooth::{Cause, Smoothed, smooth};
pub use starts::{Begun, fit_start};
