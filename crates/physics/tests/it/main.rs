//! Integration tests of this crate, in one binary, so that the crate is linked only once.

/// Paths of the measured and the reference data of the tests.
#[path = "../../../../tests/support/shared_data.rs"]
mod shared_data;

// The ball: engine, data generator, error floor, PyBullet.
mod ball_floor;
mod ball_laws;
mod ball_sensitivities;
mod bullet_golden;
mod drop_distribution;
mod system_ball;

// Pushing: engine, laboratory, interpolated poses.
mod push_golden;
mod push_laboratory;
mod push_laws;
mod push_poses;
mod system_push;

// Model files of both scenarios.
mod model_file;
mod push_model_file;

// State equations written in Rust.
mod ode;
