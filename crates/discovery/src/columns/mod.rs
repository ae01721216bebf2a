//! Candidates, and by how much each would change the predictions.

mod candidates;
mod group;
mod linear_problem;

pub(crate) use candidates::{Family, laws, library, may_join};
pub(crate) use group::probe;
pub(crate) use linear_problem::{LinearProblem, SEEN, Sums, summed};
