//! Trajectories with named columns and units: readers, writers, splits, normalisation.
//!
//! A [`Dataset`] holds [`Trajectory`]s that share [`Column`]s; every column name ends in its SI
//! [`Unit`] (`height_m`, `velocity_m_s`). [`read_dataset`] reads any known layout,
//! [`read_csv`] and [`write_csv`] exchange the long form with files, [`read_npz`] and [`write_npz`] the same
//! names with numpy, [`push`] reads measured pushes, [`Split`] deals whole trajectories out for training and testing, [`Normaliser`] scales
//! columns, [`Summary`] describes a set for people, [`checks`] find sets that cannot be what their names say,
//! [`atomic_write`] writes a file whole or not at all, [`Limit`] bounds what a file may ask of the machine, [`printable`]
//! makes its text fit for a terminal, and [`random_stream`] gives every (seed, purpose, index) its own random numbers.

mod assemble;
pub mod atomic_file;
pub mod checks;
mod column;
pub mod convert;
mod csv_long;
mod csv_named;
mod csv_source;
mod dataset;
mod error;
mod format;
mod legacy_ball;
mod limits;
mod normalise;
mod npz;
mod printable;
pub mod push;
mod random_stream;
mod source;
mod split;
mod statistics;
mod stream_summary;
mod summary;
mod trajectory;
mod unit;
mod whole_file;

pub use atomic_file::{
    AtomicWriteError, WriteStep, abandon_writes, atomic_write, check_writable, remove_stale,
};
pub use column::{Column, GROUP, TIME, TRAJECTORY};
pub use csv_long::{MissingCells, read_csv, write_csv};
pub use csv_named::NamedCsv;
pub use dataset::Dataset;
pub use error::{ColumnError, DataError, RowRemedy};
pub use format::{read_dataset, read_table, write_dataset};
pub use legacy_ball::read_legacy_ball;
pub use limits::{Limit, LimitExceeded, LimitSetting};
pub use normalise::{ColumnScale, Normaliser};
pub use npz::{read_npz, write_npz};
pub use printable::{printable, shown, shown_cause, shown_list};
pub use random_stream::random_stream;
pub use source::Source;
pub use split::{Split, SplitSize};
pub use stream_summary::{PushSummary, StreamSummary};
pub use summary::{ColumnSummary, LengthSummary, SamplingSummary, Statistics, Summary};
pub use trajectory::Trajectory;
pub use unit::{Dimensions, Unit};
pub use whole_file::read_text;
