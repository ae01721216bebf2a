#![doc = include_str!("../README.md")]

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
mod escape_control_characters;
mod foreign;
mod format;
mod frame_clock;
mod legacy_ball;
mod limits;
mod normalise;
mod npz;
mod npz_fault;
pub mod push;
mod random_stream;
mod sniff;
mod source;
mod split;
mod statistics;
mod stream_summary;
mod summary;
mod trajectory;
mod unit;
mod whole_file;

pub use atomic_file::{
    AtomicWriteError, WriteStep, atomic_write, check_writable, remove_stale_temporaries,
    remove_unfinished_writes,
};
pub use column::{Column, GROUP, TIME, TRAJECTORY};
pub use csv_long::{MissingCells, read_csv, write_csv};
pub use csv_named::NamedCsv;
pub use dataset::Dataset;
pub use error::{ColumnError, DataError, RowRemedy, unreadable_text};
pub use escape_control_characters::{escape_control_characters, escaped_cause, escaped_list, escaped_short};
pub use foreign::ForeignKind;
pub use format::{read_csv_bytes, read_dataset, write_dataset};
pub use frame_clock::FrameClock;
pub use legacy_ball::read_legacy_ball;
pub use limits::{Limit, LimitExceeded, LimitSettingError};
pub use normalise::{ColumnScale, Normaliser};
pub use npz::{read_npz, write_npz};
pub use npz_fault::ArrayFault;
pub use random_stream::random_stream;
pub use sniff::{ColumnMapping, RecognisedData, RecognitionOptions, RecordingKind, Unrecognised, recognise};
pub use source::Source;
pub use split::{Split, SplitSize};
pub use statistics::{digits, estimate_digits, with_significant};
pub use stream_summary::{PushSummary, StreamSummary};
pub use summary::{ColumnSummary, LengthSummary, SamplingSummary, Statistics, Summary};
pub use trajectory::Trajectory;
pub use unit::{Dimensions, FileUnit, NonSiEnding, Unit, non_si_ending};
pub use whole_file::read_text;
