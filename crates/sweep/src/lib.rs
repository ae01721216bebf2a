#![doc = include_str!("../README.md")]

pub mod args;
mod attempt;
mod clap_options;
mod collect;
mod collected;
mod curves;
mod failed;
mod fault;
mod file;
mod here;
mod inputs;
mod page;
mod plan;
mod row;
mod run;
mod scores;
mod status;
mod store;
mod submit;
mod task;

pub use clap_options::Program;
pub use run::{Shared, exit_code, run};
