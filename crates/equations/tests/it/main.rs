//! The integration tests of this crate, as modules of one binary, so that the crate is linked only once.

// From the text of a file to its rates.
mod derivatives;
mod hostile_files;
mod messages;

// The engine, and its interface for calibration and discovery.
mod bridge;
mod engine;
mod external;
mod group_values;

// The library of effects.
mod effects;

// Robots.
mod robot;
mod robot_effects;
mod robot_messages;
mod without_states;
