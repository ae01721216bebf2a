//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked
//! once.

/// Programs of other languages.
#[path = "../../../../tests/support/programs.rs"]
mod programs;

// Answers for models and data that a test writes.
mod answers;

// The page of a discovery.
mod discovery_page;

// Results of the joints of a robot.
mod joints;

// Exported programs follow the engine.
mod exported;

// The examples of this crate run.
mod examples;

// Estimated noise gives prediction bands with the nominal coverage.
mod noise_bands;

// Traps of logging: controllers, late inputs, recordings that differ.
mod logging_traps;

// The scatter between recordings with the same inputs.
mod repeats;
