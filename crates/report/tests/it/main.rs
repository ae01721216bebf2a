//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked once.

// Rules that every drawing satisfies.
mod common;

// Figures, and whole pages.
mod figures;
mod reports;
