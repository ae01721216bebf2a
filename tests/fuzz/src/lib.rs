//! Mutation fuzzing of everything that augsim reads, on stable Rust and in one process for each core.
//!
//! ```sh
//! cargo run --release -p augsim-fuzz -- run                        # 200,000 inputs, as in .ci/run
//! cargo run --release -p augsim-fuzz -- run --inputs 10000000 --seed 7
//! cargo run --release -p augsim-fuzz -- corpus                     # everything that ever broke
//! ```
//!
//! Input `k` of a campaign depends on the campaign's seed, on `k` and on the [`seeds`] alone, so a finding is repeated
//! by its number. A [`reader`] takes the mutated file from the disk, as the command line would, and says whether it
//! was accepted or refused; a panic, an abort, more than [`limits`] allow, or a broken promise about what was read or
//! said is a [`Finding`](verdict::Finding). Readers run in child processes, because an abort cannot be caught.

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
