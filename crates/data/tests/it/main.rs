//! Integration tests of this crate in one binary, so that the crate is linked once.

/// Paths of measured and golden data.
#[path = "../../../../tests/support/shared_data.rs"]
mod shared_data;

// Readers and writers.
mod clocks_and_units;
mod csv_errors;
mod csv_round_trip;
mod foreign_files;
mod named_csv;
mod push_errors;
mod push_files;

// Limits on the memory that a file may request.
mod limits;

// Scales, summaries and the checks of suspicious data.
mod logging_mistakes;
mod scaling_and_summary;
mod suspicious_data;
mod wrapped_and_celsius;
