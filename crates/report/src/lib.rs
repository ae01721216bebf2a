#![doc = include_str!("../README.md")]

pub mod benchmark;
pub mod figure;
mod nullable;
pub mod page;
mod plot;

pub use benchmark::{BenchmarkReport, benchmark_report};
pub use plot::text::capitalised;
