//! Errors of data folders that lack the files of a reproduction.

use std::path::PathBuf;
use thiserror::Error;

/// Data folder without the required files.
#[derive(Debug, Error)]
pub enum MissingData {
    /// No benchmark data set was found.
    #[error("{}: the folder contains none of the data sets `{}`", data.display(), sets.join("`, `"))]
    Systems {
        /// Data folder.
        data: PathBuf,
        /// Folder names of the known data sets.
        sets: Vec<&'static str>,
    },
    /// The folder with drops does not exist.
    #[error(
        "{}: the folder does not exist; give the folder with `train.csv.gz` and `test_1000.csv.gz`, or omit --data to \
         generate drops", folder.display()
    )]
    Drops {
        /// Data folder.
        folder: PathBuf,
    },
    /// No push files were found.
    #[error(
        "{}: contains neither published MIT Push files (folders `abs`, `delrin`, `plywood`, `pu`) nor \
         `mit-pusher-slider-runs`; omit --data to generate pushes in the virtual laboratory", folder.display()
    )]
    Pushes {
        /// Data folder.
        folder: PathBuf,
    },
}
