//! The predictions near a fitted set as a linear problem.

mod group;
mod problem;

pub(crate) use group::{ColumnGroup, ColumnKind, acting_points, null_points, probe};
pub(crate) use problem::{BlockSums, LinearProblem, MIN_INDEPENDENT_SHARE, sum_blocks};
