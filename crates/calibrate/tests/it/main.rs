//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked once.

// Parameters and start states by least squares, and the noise of sensor and motion.
mod calibrate;
mod smooth;
