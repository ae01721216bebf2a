//! Helpers shared by the integration tests: where data lies, random inputs, gradient checks.

pub mod golden;
pub mod gradient;
pub mod operations;
pub mod random;
