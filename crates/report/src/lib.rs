#![doc = include_str!("../README.md")]

pub mod benchmark;
pub mod discovery;
pub mod figure;
mod nullable;
pub mod page;
mod plot;

pub use benchmark::{BenchmarkReport, benchmark_report};
pub use discovery::{DiscoveryReport, discovery_excerpt, discovery_figures, discovery_report, figure_names};
