//! The integration tests of this crate, in one binary that links the crate once.

// Physics engines that nets correct.
mod equation_engine;
mod model_engine;

// Training of all model classes.
mod league;
mod unseen_restitution;

// Nets in a control loop.
mod stepper;
