//! Integration tests of this crate: one binary with a module per file, so that the crate is linked once.

// Parameters and initial states by least squares; process noise and measurement noise.
mod calibrate;
mod smooth;
