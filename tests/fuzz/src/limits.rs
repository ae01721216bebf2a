//! Limits on memory, time, file size and message length for reading one mutated input.

use std::time::Duration;

/// Largest memory for reading one file, bytes: eight times the limit on unpacked bytes.
pub const MAX_MEMORY_BYTES: usize = 512 << 20;

/// `(name, value)` of the environment variable that limits unpacked bytes in the child processes.
///
/// The limit is low so that a file at the limit is read quickly.
pub const UNPACKED_LIMIT: (&str, &str) = ("AUGSIM_LIMIT_BYTES", "64000000");

/// Longest wall-clock time for reading one input.
///
/// The slowest valid inputs take 30 ms on an idle core; the margin is for busy machines.
pub const MAX_TIME: Duration = Duration::from_secs(10);

/// Largest size of a mutated file, bytes.
pub const MAX_INPUT_BYTES: usize = 64 << 10;

/// Longest message about a file, characters without the file's path: one terminal page.
pub const MAX_MESSAGE_CHARS: usize = 2000;
