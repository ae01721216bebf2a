//! How much of the machine one input may take.

use std::time::Duration;

/// Memory that reading one file of at most [`LARGEST_INPUT`] may take at once, bytes. Gzip cannot expand by more than
/// 1032, and numbers take up to four times their text, so honest readers stay below by far.
pub const MEMORY: usize = 512 << 20;

/// Wall-clock time for one input. The slowest harmless ones take 30 ms on an idle core; the rest is for busy machines.
pub const TIME: Duration = Duration::from_secs(10);

/// Mutations do not grow a file beyond this, bytes.
pub const LARGEST_INPUT: usize = 64 << 10;

/// Longest message about a file, characters beside the file's own path: a terminal's page.
pub const LONGEST_MESSAGE: usize = 2000;
