//! SVG figures and the self-contained HTML report.
//!
//! Everything here is plain data in and text out: the same input gives the same bytes, there is no
//! script and no external resource, and missing or constant data are drawn as such. Figures are in
//! [`figure`], the page in [`page`], and the reports that the program writes are
//! [`benchmark_report`] and [`discovery_report`].

pub mod benchmark;
pub mod discovery;
pub mod figure;
mod nullable;
pub mod page;
mod plot;

pub use benchmark::{BenchmarkReport, benchmark_report};
pub use discovery::{DiscoveryReport, discovery_excerpt, discovery_figures, discovery_report};
