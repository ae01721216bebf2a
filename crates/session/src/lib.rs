#![doc = include_str!("../README.md")]

mod allowed_effects;
pub mod command_line;
pub mod configure;
mod data_from;
mod discover;
pub mod discovery_page;
pub mod equations;
pub mod export;
mod failure;
pub mod filtered;
pub mod folders;
pub mod forecast;
mod model_or_run;
pub mod predict;
mod prefix_length;
pub mod provenance;
mod report_context;
pub mod residual;
pub mod robot;
pub mod run_data;
pub mod run_dir;
mod run_lock;
pub mod simulate;
pub mod states;
mod subject;
pub mod table;
pub mod training_run;
pub mod usage;

pub use data_from::DataFrom;
pub use discover::{DiscoverRequest, Discovered, OpenData, discover, discover_in};
pub use failure::{Failure, sentence};
pub use model_or_run::{ModelOrRun, discovery_in};
pub use report_context::ReportContext;
pub use run_lock::RunLock;
pub use subject::Subject;
pub use usage::Usage;
