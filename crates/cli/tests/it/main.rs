//! Integration tests of this crate in one binary, so that the crate is linked once. Each file is a
//! module.

/// Folders of measured and golden data.
#[path = "../../../../tests/support/shared_data.rs"]
mod shared_data;

/// One data set of throws, written in twelve file layouts.
#[path = "../../../../tests/support/throws_as_files.rs"]
mod throws_as_files;

/// Access to the Markdown documents of the repository.
#[path = "../../../../tests/support/documents.rs"]
mod documents_on_disk;

/// Programs of other languages.
#[path = "../../../../tests/support/programs.rs"]
mod programs;

// Helpers that run the binary.
mod command;

// Input: reading, limits, errors and their messages.
mod bad_input;
mod limits;
mod own_files;
mod reading;
mod short_records;
mod suspicious_data;
mod time_and_units;

// From a recording to a result.
mod exported;
mod filtered;
mod found;
mod nets_of_equations;
mod next_experiment;
mod residual;
mod robot;
mod simulate_push;
mod start;
mod systems;
mod workflow;

// Runs: files, bytes, resuming.
mod outputs;
mod resume;
mod robots;
mod run_directory;
mod same_bytes;

// Documents and texts of reports.
mod documents;
mod readme;
mod report_words;

// Reproductions and sweeps.
mod reproduce_push;
mod sweep;
