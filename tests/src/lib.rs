//! Shared by the integration tests: where data lies, random inputs, gradient checks, sealed ball data and their scoring.

pub mod battery;
pub mod golden;
pub mod gradient;
pub mod operations;
pub mod random;
pub mod sealed;
