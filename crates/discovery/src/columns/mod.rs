//! Candidate effects and the changes of the predictions that each would make.

mod builder;
mod candidates;
mod group;
mod linear_problem;
mod linearise;
mod periodogram;

pub(crate) use candidates::{Family, can_join, library_candidates, table_candidates};
pub(crate) use group::probe;
pub(crate) use linear_problem::{BlockSums, LinearProblem, MIN_INDEPENDENT_SHARE, sum_blocks};
