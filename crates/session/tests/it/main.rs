//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked
//! once.

/// Programs of other languages.
#[path = "../../../../tests/support/programs.rs"]
mod programs;

// The page of a discovery.
mod discovery_page;

// Results of the joints of a robot.
mod joints;
mod logging_traps;

// Exported programs follow the engine.
mod exported;

// The examples of this crate run.
mod examples;

// Estimated noise gives prediction bands with the nominal coverage.
mod noise_bands;

// The scatter between recordings with the same inputs.
mod repeats;
