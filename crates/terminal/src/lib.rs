#![doc = include_str!("../README.md")]

pub mod destination;
pub mod discover_args;
pub mod discovery;
pub mod interrupt;
mod outcome;
pub mod output;
pub mod progress;
pub mod record;
pub mod threads;
pub mod time_limit;
pub mod training;
pub mod watched;

pub use augsim_session::Usage;
pub use outcome::Outcome;
