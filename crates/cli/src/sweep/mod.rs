//! Many independent runs of one command: planned here, run here or by a cluster's scheduler, collected here.
//!
//! `SWEEP.toml` ([`mod@file`]) is crossed into tasks ([`task`], [`plan`]), each of which names everything that decides its
//! result. A task is run by [`attempt`], whoever asks for it: this machine ([`here`]) or an array job ([`mod@submit`]). What is
//! done lies in the plan's folder ([`store`]) under names that follow from the tasks, so nothing else keeps a state.

pub mod args;
mod attempt;
mod clap_options;
mod collect;
mod collected;
mod curves;
pub mod failed;
pub mod fault;
mod file;
mod here;
mod inputs;
mod page;
mod plan;
mod row;
mod scores;
mod status;
mod store;
mod submit;
mod task;

pub use collect::collect;
pub use here::{run_all, run_some};
pub use plan::write_plan;
pub use status::status;
pub use submit::{Wishes, submit};
