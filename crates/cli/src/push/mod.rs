//! Planar pushing on the command line: data, the tables of models, the repeated push, measured runs, the report.

mod data;
mod experiment;
mod plan;
mod repeat;
mod report;
mod rows;
mod runs;

pub use data::{Laboratory, PushData, load, on_one_clock, read_file};
pub use experiment::Experiment;
pub use plan::Plan;
pub use rows::{Row, sets, table};
pub use runs::folder as runs_folder;
