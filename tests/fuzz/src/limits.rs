//! How much of the machine one input may take.

use std::time::Duration;

/// Memory that reading one file may take at once, bytes: eight times what may be unpacked.
pub const MEMORY: usize = 512 << 20;

/// Limit on unpacked bytes that the children run under, so that a file at the limit is read in a moment: the variable of
/// `augsim_data`'s limits, and its value.
pub const UNPACKED: (&str, &str) = ("AUGSIM_LIMIT_BYTES", "64000000");

/// Wall-clock time for one input. The slowest harmless ones take 30 ms on an idle core; the rest is for busy machines.
pub const TIME: Duration = Duration::from_secs(10);

/// Mutations do not grow a file beyond this, bytes.
pub const LARGEST_INPUT: usize = 64 << 10;

/// Longest message about a file, characters beside the file's own path: a terminal's page.
pub const LONGEST_MESSAGE: usize = 2000;
