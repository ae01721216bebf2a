//! Which layout a file has, told by its content.

use crate::column::{TIME, TRAJECTORY};
use crate::csv_long::{MissingCells, read_long, write_csv};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::legacy_ball::read_ball;
use crate::npz::{is_npz, npz_of_bytes, write_npz};
use crate::push::{PushError, holds_trial, push_dataset_of_bytes, read_push_dataset};
use crate::sniff::{Reading, recognise, recognise_bytes};
use crate::whole_file::read_whole;
use std::path::Path;

/// Bytes from the beginning of a file that tell its layout.
const TELLING: usize = 64;

/// Reads a data set in any layout that this crate knows: CSV in long form or the ball layout
/// `traj,step,t,height,velocity`, plain or gzip; NPZ; and the published push files (HDF5, JSON, a zip archive
/// or a folder of them). A text that is in none of them is recognised where its columns can be told
/// ([`recognise`](crate::recognise)); [`Dataset::notes`] then say what was taken for granted. `-` is standard input; a FIFO or `/dev/stdin` is read like any file.
///
/// ```
/// use augsim_data::{MissingCells, read_dataset};
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("drops.csv");
/// std::fs::write(&file, "trajectory,t_s,height_m\na,0,1.5\na,0.1,1.45\nb,0,2\nb,0.1,1.95\n")?;
/// let data = read_dataset(&file, MissingCells::Refuse)?;
/// assert_eq!(data.trajectories().len(), 2);
/// assert_eq!(data.trajectories()[1].column(0), [2.0, 1.95]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Any of the readers' [`DataError`]s. A file of none of these layouts is reported as a faulty long form.
pub fn read_dataset(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    if path.is_dir() {
        return match read_push_dataset(path) {
            // A folder without published pushes may hold recordings, one file a trajectory.
            Err(nothing @ DataError::Push(PushError::Nothing { .. })) => {
                match recognise(&[path.to_owned()], &Reading::default(), missing) {
                    Err(DataError::NotRecognised { path: there, .. }) if there == path => Err(nothing),
                    read => read.map(|r| r.data),
                }
            }
            read => read,
        };
    }
    let bytes = read_whole(path)?;
    if bytes.starts_with(b"PK") && is_npz(path, &bytes)? {
        return npz_of_bytes(path, &bytes, missing);
    }
    if holds_trial(&bytes[..bytes.len().min(TELLING)]) {
        return push_dataset_of_bytes(path, bytes);
    }
    match read_strictly(path, bytes.clone(), missing) {
        Err(Refused { cause, long_form }) if relents(&cause) => {
            let read = recognise_bytes(path, bytes, missing);
            // A file that is meant to be in the long form is told what is wrong with it there.
            read.map(|r| r.data).map_err(|e| if long_form { cause } else { e })
        }
        Err(Refused { cause, .. }) => Err(cause),
        Ok(data) => Ok(data),
    }
}

/// Why a file is not in the long form.
struct Refused {
    cause: DataError,
    /// Its header is that of the long form.
    long_form: bool,
}

impl From<DataError> for Refused {
    fn from(cause: DataError) -> Self {
        Refused { cause, long_form: false }
    }
}

fn read_strictly(path: &Path, bytes: Vec<u8>, missing: MissingCells) -> Result<Dataset, Refused> {
    let source = CsvSource::of_bytes(path, bytes)?;
    if source.header() == ["traj", "step", "t", "height", "velocity"] {
        return read_ball(source).map_err(|cause| Refused { cause, long_form: true });
    }
    let long_form = [TRAJECTORY, TIME].iter().all(|name| source.header().iter().any(|h| h == name));
    read_long(source, missing).map_err(|cause| Refused { cause, long_form })
}

/// Whether a file that is refused for this may be understood otherwise.
fn relents(cause: &DataError) -> bool {
    matches!(
        cause,
        DataError::MissingColumn { .. }
            | DataError::OtherSeparator { .. }
            | DataError::BadColumn { .. }
            | DataError::NoValueColumns { .. }
            | DataError::DuplicateColumn { .. }
            | DataError::RaggedRow { .. }
            | DataError::BadNumber { .. }
            | DataError::NotUtf8 { .. }
            | DataError::TimeNotIncreasing { .. }
            | DataError::TrajectoryReappears { .. }
    )
}

/// Reads the CSV file in long form that a table in memory would be written to; `name` is for messages.
///
/// # Errors
/// The errors of [`read_csv`](crate::read_csv).
pub fn read_table(name: &str, csv: Vec<u8>, missing: MissingCells) -> Result<Dataset, DataError> {
    read_long(CsvSource::of_bytes(Path::new(name), csv)?, missing)
}

/// Writes a data set, as NPZ where the name ends in `.npz`, otherwise as CSV in long form; all or nothing.
///
/// # Errors
/// The errors of [`write_csv`] and [`write_npz`].
pub fn write_dataset(dataset: &Dataset, path: &Path) -> Result<(), DataError> {
    match path.extension().is_some_and(|extension| extension == "npz") {
        true => write_npz(dataset, path),
        false => write_csv(dataset, path),
    }
}
