//! The steps of a user's session, for every door to it: the command line and the Python package call the same functions, so
//! that the same inputs and seed give the same bytes through both.
//!
//! [`Subject`] is a model file of any kind, [`DataFrom`] says where trajectories come from, [`discover`] closes the loop on
//! them, [`training_run`] trains into a [`run_dir`], [`forecast`] sums up what a trained run foretells, [`Failure`] sorts what
//! went wrong. Nothing here prints.

mod circumstances;
pub mod command_line;
pub mod configure;
mod data_from;
mod discover;
pub mod discovery_page;
mod failure;
pub mod folders;
pub mod forecast;
pub mod provenance;
pub mod residual;
pub mod run_data;
pub mod run_dir;
mod run_lock;
pub mod simulate;
mod subject;
pub mod table;
pub mod training_run;
mod usage;
pub mod written;

pub use circumstances::Circumstances;
pub use data_from::DataFrom;
pub use discover::{Wanted, discover};
pub use failure::{Failure, sentence};
pub use run_lock::RunLock;
pub use subject::Subject;
pub use usage::Usage;
