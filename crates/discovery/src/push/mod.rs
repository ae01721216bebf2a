//! The loop for planar pushing.
//!
//! Recorded pushes are cut into windows by the rod's travel (multiple shooting: Bock and Plitt 1984); the pose at the start
//! of each is a nuisance that every fit eliminates. Only fresh samples are observations, the rod follows its own. A window
//! whose misfit is far beyond what is typical costs the logarithm of it, and in the end is left out and counted. Windows are
//! not independent samples of white noise where the model is wrong in other ways: what an addition must gain is in units of the
//! dispersion that the windows' gradients have in its own direction (Rotnitzky and Jewell 1990), intervals are those of the
//! sandwich (White 1982).

mod adequacy;
mod anatomy;
mod crossed;
mod decide;
mod discover;
mod error_table;
mod evaluate;
mod examples;
mod experiment;
mod fit;
mod forecast;
mod foretell;
mod hypothesis;
mod measured;
mod numbers;
mod ranking;
mod report;
mod scatter;
mod scene;
mod score;
mod search;
mod spread;

pub use discover::{assess_push, discover_push};
pub use foretell::foretell_push;
pub use scene::PushScene;
