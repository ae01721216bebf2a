//! Mutation fuzzing of all file readers of augsim, on stable Rust with one process per core.
//!
//! ```sh
//! cargo run --release -p augsim-fuzz -- run                        # 200,000 inputs, as in .ci/run
//! cargo run --release -p augsim-fuzz -- run --inputs 10000000 --seed 7
//! cargo run --release -p augsim-fuzz -- corpus                     # all inputs that once broke a reader
//! ```
//!
//! Input `k` of a campaign depends only on the seed of the campaign, on `k` and on the [`seeds`], so a
//! finding can be reproduced by its number. A [`reader`] reads the mutated file from disk, as the command
//! line does, and returns whether it was accepted or rejected. A panic, an abort, more time or memory than
//! the [`limits`], or a violated guarantee about the data or the message is a [`Finding`](verdict::Finding).
//! Readers run in child processes, because an abort cannot be caught.

pub mod campaign;
pub mod child;
pub mod corpus;
pub mod envelope;
pub mod limits;
pub mod mutation;
pub mod parent;
pub mod reader;
pub mod readers;
pub mod seeds;
pub mod verdict;
