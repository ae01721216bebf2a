//! Code shared by the integration tests.
//!
//! Fixtures, random inputs, gradient checks, generators of data with known truth, and scoring of answers.

pub mod answers;
pub mod battery;
pub mod characterisation;
pub mod discover_command;
pub mod fleets;
pub mod gaps;
pub mod golden;
pub mod gradient;
pub mod linear;
pub mod measured_pushes;
pub mod next_battery {
    //! Inputs of the battery of designed experiments.
    pub mod pairs;
}
pub mod operations;
pub mod push_battery;
pub mod random;
pub mod sealed;
pub mod sealed_memory;
pub mod sealed_push;
pub mod sealed_systems;
pub mod traps;
pub mod unmodelled_systems;
