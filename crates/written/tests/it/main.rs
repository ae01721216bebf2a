//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked
//! once.

// From text to rates: messages, hostile files, derivatives.
mod derivatives;
mod hostile_files;
mod messages;

// The engine, and what discovery sees of it.
mod bridge;
mod engine;

// The library of effects.
mod effects;
