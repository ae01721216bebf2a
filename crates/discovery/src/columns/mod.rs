//! Candidate effects and the changes of the predictions that each would make.

mod builder;
mod candidates;
mod linearise;
mod periodogram;

pub(crate) use candidates::{Family, can_join, library_candidates, table_candidates};
pub(crate) use linearise::linearise;
