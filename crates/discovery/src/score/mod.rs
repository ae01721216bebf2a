//! How good a set of effects is: the algebra of blocks.

mod blocks;
mod evidence;
mod independence;
mod jackknife;
mod rows;
mod scored;

pub(crate) use blocks::{BLOCKS, Blocks};
pub(crate) use evidence::Evidence;
pub(crate) use jackknife::{distance, freedom, move_without};
pub(crate) use rows::{Places, Rows, WindowRows};
pub(crate) use scored::{Scored, held, off_nulls};
