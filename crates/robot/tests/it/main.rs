//! Tests of the crate's public items, in one program.

mod arms;
mod dynamics;
mod energy;
mod tree;
