#![doc = include_str!("../README.md")]

mod absent;
pub mod args;
mod chain;
pub mod experiment;
mod filtered;
mod league;
mod measured;
mod next;
mod reproduction;
mod rigs;
mod robots;
mod systems;
mod tables;

pub use tables::run;
