//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked once.

// Engines of the physics that nets correct.
mod model_engine;
mod written_engine;

// Every model class learns.
mod league;
mod unseen_restitution;

// A net in a control loop.
mod stepper;
