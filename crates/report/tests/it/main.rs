//! The integration tests of this crate, in one binary: each file is a module, so that the crate is linked
//! once.

// Checks that every figure and page must pass.
mod common;

// Figures, and whole pages.
mod figures;
mod reports;
