#![doc = include_str!("../README.md")]

mod growth;
mod identifiability;
mod kalman;
mod lengths;
mod linearise;
mod minima;
mod normal;
mod outcome;
mod per_group;
mod smooth;
mod starts;
mod steps;
mod variances;
mod windows;

pub use growth::calibrate;
pub use outcome::{Calibration, CalibrationError, Gauge, GroupCalibration, Stage};
pub use per_group::PerGroup;
pub use smooth::{Cause, Smoothed, smooth};
pub use starts::{InitialStateEstimate, estimate_initial_state};
