//! Scores of fitted sets of effects, computed over blocks of the data.

mod blocks;
mod cells;
mod clusters;
mod evidence;
mod independence;
mod jackknife;
mod kept;
mod rows;
mod scored;

pub(crate) use blocks::{BLOCKS, Blocks, are_comparable};
pub(crate) use clusters::Clusters;
pub(crate) use evidence::Evidence;
pub(crate) use jackknife::{distance, freedom, lag_weight, step_without_block};
pub(crate) use rows::{FitWindows, Rows, WindowRows};
pub(crate) use scored::{BEYOND_NOISE, OUTSIDE_95, Scored, distances_from_nulls, entries_at_bounds};
