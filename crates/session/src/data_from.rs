//! The source of trajectories: a file, or a table in memory that is read like one.

use crate::provenance::{fingerprint, fingerprint_of_bytes};
use augsim_data::{
    DataError, Dataset, MissingCells, NamedCsv, RecognitionOptions, TRAJECTORY, Trajectory, digits,
    read_csv_bytes, read_dataset, recognise,
};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where measured trajectories are read from: files, or a table in memory.
#[derive(Debug, Clone, PartialEq)]
pub enum DataFrom {
    /// A file or folder in any layout that [`read_dataset`] knows.
    File(PathBuf),
    /// A file or folder with the time column that the user names, such as `clock:ms`.
    FileWithTime {
        /// Path of the file or folder.
        path: PathBuf,
        /// Name of the time column, with its unit after a colon.
        time: String,
    },
    /// Several files or folders as one set of recordings.
    Files {
        /// Paths of the files or folders, at least one.
        paths: Vec<PathBuf>,
        /// Name of the time column, with its unit after a colon; `None` if the user names none.
        time: Option<String>,
    },
    /// Data whose groups of trajectories are in a column that the user names.
    Grouped {
        /// The data.
        data: Box<DataFrom>,
        /// Name of the column that holds the group of each trajectory.
        column: String,
    },
    /// A table in memory, stored as CSV so that it is read by the same code as files.
    Table {
        /// Name of the table in messages.
        name: String,
        /// Content of the table as bytes of a CSV file.
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
    fn from(source: &DataFrom) -> Self {
        source.clone()
    }
}

/// Writes the path of the data, or the name of the table in memory.
impl fmt::Display for DataFrom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DataFrom::File(path) | DataFrom::FileWithTime { path, .. } => write!(f, "{}", path.display()),
            DataFrom::Files { paths, .. } => {
                let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
                f.write_str(&names.join(", "))
            }
            DataFrom::Grouped { data, .. } => data.fmt(f),
            DataFrom::Table { name, .. } => f.write_str(name),
        }
    }
}

impl DataFrom {
    /// Refers to a file or folder, with its time column if the user names one.
    pub fn with_time(path: &Path, time: Option<&str>) -> Self {
        match time {
            Some(time) => DataFrom::FileWithTime { path: path.to_owned(), time: time.to_owned() },
            None => DataFrom::File(path.to_owned()),
        }
    }

    /// Refers to several files or folders, with their time column if the user names one.
    pub fn of_paths(paths: &[PathBuf], time: Option<&str>) -> Self {
        match paths {
            [one] => Self::with_time(one, time),
            several => DataFrom::Files { paths: several.to_vec(), time: time.map(str::to_owned) },
        }
    }

    /// The same data, with the groups of the trajectories in this column if the user names one.
    pub fn with_groups(self, column: Option<&str>) -> Self {
        match column {
            Some(column) => DataFrom::Grouped { data: Box::new(self), column: column.to_owned() },
            None => self,
        }
    }

    /// The data as they are in the file, whatever column holds their groups.
    pub fn ungrouped(&self) -> &DataFrom {
        match self {
            DataFrom::Grouped { data, .. } => data.ungrouped(),
            other => other,
        }
    }

    /// Path of the file or folder; `None` for several files and for a table in memory.
    pub fn path(&self) -> Option<&Path> {
        match self {
            DataFrom::File(path) | DataFrom::FileWithTime { path, .. } => Some(path),
            DataFrom::Grouped { data, .. } => data.path(),
            DataFrom::Files { .. } | DataFrom::Table { .. } => None,
        }
    }

    /// Reads the trajectories of this source.
    ///
    /// # Errors
    /// As [`read_dataset`].
    pub fn read(&self, missing: MissingCells) -> Result<Dataset, DataError> {
        match self {
            DataFrom::File(path) => read_dataset(path, missing),
            DataFrom::FileWithTime { path, time } => {
                let reading =
                    RecognitionOptions { time: Some(time.clone()), ..RecognitionOptions::default() };
                recognise(std::slice::from_ref(path), &reading, missing).map(|recognised| recognised.data)
            }
            DataFrom::Files { paths, time } => {
                let reading = RecognitionOptions { time: time.clone(), ..RecognitionOptions::default() };
                recognise(paths, &reading, missing).map(|recognised| recognised.data)
            }
            DataFrom::Grouped { data, column } => {
                let read = data.read(missing)?;
                let index = if column == TRAJECTORY { None } else { Some(read.column_index(column)?) };
                let labelled = |t: &Trajectory| {
                    let Some(index) = index else { return t.clone().in_own_group() };
                    let label = t.column(index).first().map_or_else(String::new, |v| digits(*v));
                    t.clone().with_group(label)
                };
                let trajectories: Result<Vec<Trajectory>, DataError> =
                    read.trajectories().iter().map(labelled).collect();
                read.with_trajectories(trajectories?)
            }
            DataFrom::Table { name, csv } => read_csv_bytes(name, csv.to_vec(), missing),
        }
    }

    /// Opens the data for reading the columns that a model names.
    ///
    /// # Errors
    /// As [`NamedCsv::open`].
    pub fn named(&self) -> Result<NamedCsv, DataError> {
        match self {
            DataFrom::File(path) => NamedCsv::open(path),
            DataFrom::FileWithTime { path, time } => NamedCsv::open_with_time(path, Some(time)),
            DataFrom::Files { paths, time } => NamedCsv::open_files(paths, time.as_deref()),
            DataFrom::Grouped { data, column } => data.named()?.with_groups(column),
            DataFrom::Table { name, csv } => NamedCsv::from_csv(name, csv.to_vec()),
        }
    }

    /// CRC-32 checksum and size of the data, as text.
    pub fn fingerprint(&self) -> String {
        match self {
            DataFrom::File(path) | DataFrom::FileWithTime { path, .. } => fingerprint(path),
            DataFrom::Files { paths, .. } => {
                paths.iter().map(|path| fingerprint(path)).collect::<Vec<_>>().join(", ")
            }
            DataFrom::Grouped { data, .. } => data.fingerprint(),
            DataFrom::Table { csv, .. } => fingerprint_of_bytes(csv),
        }
    }
}
