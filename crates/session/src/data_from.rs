//! Where trajectories come from: a file, or a table in memory that is read like one.

use crate::provenance::{fingerprint, fingerprint_of_bytes};
use augsim_data::{DataError, Dataset, MissingCells, NamedCsv, read_dataset, read_table};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where trajectories come from.
#[derive(Debug, Clone, PartialEq)]
pub enum DataFrom {
    /// A file or folder in any layout that [`read_dataset`] knows.
    File(PathBuf),
    /// A table in memory as the CSV file that it would be written to: whatever holds for files holds for it.
    Table {
        /// Its name, for messages.
        name: String,
        /// The file's bytes.
        csv: Arc<[u8]>,
    },
}

impl From<&Path> for DataFrom {
    fn from(path: &Path) -> Self {
        DataFrom::File(path.to_owned())
    }
}

impl From<&PathBuf> for DataFrom {
    fn from(path: &PathBuf) -> Self {
        DataFrom::File(path.clone())
    }
}

impl From<&DataFrom> for DataFrom {
    fn from(there: &DataFrom) -> Self {
        there.clone()
    }
}

/// The path, or the name of the table.
impl fmt::Display for DataFrom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DataFrom::File(path) => write!(f, "{}", path.display()),
            DataFrom::Table { name, .. } => f.write_str(name),
        }
    }
}

impl DataFrom {
    /// Reads the trajectories.
    ///
    /// # Errors
    /// As [`read_dataset`].
    pub fn read(&self, missing: MissingCells) -> Result<Dataset, DataError> {
        match self {
            DataFrom::File(path) => read_dataset(path, missing),
            DataFrom::Table { name, csv } => read_table(name, csv.to_vec(), missing),
        }
    }

    /// Opens the table for reading the columns that a model names.
    ///
    /// # Errors
    /// As [`NamedCsv::open`].
    pub fn named(&self) -> Result<NamedCsv, DataError> {
        match self {
            DataFrom::File(path) => NamedCsv::open(path),
            DataFrom::Table { name, csv } => NamedCsv::of_table(name, csv.to_vec()),
        }
    }

    /// The content in a few characters.
    pub fn fingerprint(&self) -> String {
        match self {
            DataFrom::File(path) => fingerprint(path),
            DataFrom::Table { csv, .. } => fingerprint_of_bytes(csv),
        }
    }
}
