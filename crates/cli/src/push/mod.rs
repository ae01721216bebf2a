//! Planar pushing on the command line: data, the tables of models, the repeated push, measured runs, the report.

mod data;
mod experiment;
mod plan;
mod repeat;
mod report;
mod result;
mod rows;
mod runs;

pub use data::{Laboratory, PushData, load, on_one_clock, read_file};
pub use plan::{Experiment, OneNet, Plan};
pub use result::table;
pub use rows::{Row, sets};
pub use runs::folder as runs_folder;
