//! Fits declared parameters of any [`System`](augsim_physics::system::System) to windows of records, each with start states of
//! its own (multiple shooting), and lets the windows grow as long as the model follows the data over them.
//!
//! Start states are eliminated window by window (Schur complement), so that the work grows with the number of windows and
//! not with its cube; the steps are those of Levenberg and Marquardt on a cost that bounds the influence of outliers
//! (Huber, Annals of Mathematical Statistics 35, 1964).

mod growth;
mod normal;
mod outcome;
mod starts;
mod steps;
mod windows;

pub use growth::calibrate;
pub use outcome::{Calibration, CalibrationError, Gauge, Stage};
pub use starts::{Begun, fit_start};
