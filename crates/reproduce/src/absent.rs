//! Folders of data that a reproduction was given and that do not hold what it reads.

use std::path::PathBuf;
use thiserror::Error;

/// A folder without the data of a reproduction.
#[derive(Debug, Error)]
pub enum Absent {
    /// No benchmark set of systems.
    #[error("{}: none of the folders `{}` is in it", data.display(), sets.join("`, `"))]
    Systems {
        /// The folder.
        data: PathBuf,
        /// Folders of the sets that are known.
        sets: Vec<&'static str>,
    },
    /// No folder at all where drops were to be read.
    #[error(
        "{}: there is no such folder; give the one of `train.csv.gz` and `test_1000.csv.gz`; without --data drops of the same \
         law are generated", folder.display()
    )]
    Drops {
        /// The folder.
        folder: PathBuf,
    },
    /// No push files.
    #[error(
        "{}: neither published MIT Push files (folders `abs`, `delrin`, `plywood`, `pu`) nor `mit-pusher-slider-runs` in it; \
         without --data pushes are made in the virtual laboratory", folder.display()
    )]
    Pushes {
        /// The folder.
        folder: PathBuf,
    },
}
