//! The integration tests of this crate in one binary, so that the crate is linked only once; each file is a module.

// Physics engines that nets correct.
mod model_engine;
mod written_engine;

// Training of all model classes.
mod league;
mod unseen_restitution;

// Nets in a control loop.
mod stepper;
