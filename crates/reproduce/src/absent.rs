//! Errors of data folders that lack the files that a reproduction needs.

use std::path::PathBuf;
use thiserror::Error;

/// Error of a data folder that lacks the files a reproduction needs.
#[derive(Debug, Error)]
pub enum MissingData {
    /// The folder contains none of the benchmark data sets of `reproduce systems`.
    #[error("{}: the folder contains none of the data sets `{}`", data.display(), sets.join("`, `"))]
    Systems {
        /// Data folder that was searched.
        data: PathBuf,
        /// Folder names of the known data sets.
        sets: Vec<&'static str>,
    },
    /// The folder that should contain the ball drops does not exist.
    #[error(
        "{}: the folder does not exist; give the folder with `train.csv.gz` and `test_1000.csv.gz`, or omit --data to \
         generate drops", folder.display()
    )]
    Drops {
        /// Folder that was given for the ball drops.
        folder: PathBuf,
    },
    /// The folder contains no push files of a known layout.
    #[error(
        "{}: contains neither published MIT Push files (folders `abs`, `delrin`, `plywood`, `pu`) nor \
         `mit-pusher-slider-runs`; omit --data to generate pushes in the virtual laboratory", folder.display()
    )]
    Pushes {
        /// Folder that was given for the pushes.
        folder: PathBuf,
    },
}
