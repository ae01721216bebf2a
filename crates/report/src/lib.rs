//! SVG figures and the self-contained HTML report.
//!
//! Everything here is plain data in and text out: the same input gives the same bytes, there is no
//! script and no external resource, and missing or constant data are drawn as such. Figures are in
//! [`figure`], the page in [`page`], and the reports that the program writes are
//! [`training_report`], [`push_report`] and [`discovery_report`].

pub mod discovery;
pub mod figure;
mod nullable;
pub mod page;
mod plot;
pub mod pushing;
pub mod training;

pub use discovery::{DiscoveryReport, discovery_report};
pub use pushing::{PushReport, push_report};
pub use training::{TrainingReport, training_report};
