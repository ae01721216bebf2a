#![doc = include_str!("../README.md")]

mod growth;
mod identifiability;
mod kalman;
mod lengths;
mod linearise;
mod minima;
mod normal;
mod outcome;
mod smooth;
mod starts;
mod steps;
mod variances;
mod windows;

pub use growth::calibrate;
pub use outcome::{Calibration, CalibrationError, Gauge, Stage};
pub use smooth::{Cause, Smoothed, smooth};
pub use starts::{InitialStateEstimate, estimate_initial_state};
