//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked once.

// Parameters and initial states by least squares; process noise and measurement noise.
mod calibrate;
mod smooth;
