//! Limits on memory, time, file size and message length per input.

use std::time::Duration;

/// Memory for reading one file, bytes: eight times the limit on unpacked bytes.
pub const MAX_MEMORY_BYTES: usize = 512 << 20;

/// Environment variable and value of the limit on unpacked bytes in the child processes.
///
/// It is low so that a file at the limit is read quickly.
pub const UNPACKED_LIMIT: (&str, &str) = ("AUGSIM_LIMIT_BYTES", "64000000");

/// Wall-clock time for one input. The slowest valid inputs take 30 ms on an idle core; the margin is for busy
/// machines.
pub const MAX_TIME: Duration = Duration::from_secs(10);

/// Largest size of a mutated file, bytes.
pub const MAX_INPUT_BYTES: usize = 64 << 10;

/// Longest message about a file, characters without its path: one terminal page.
pub const MAX_MESSAGE_CHARS: usize = 2000;
