//! Recognises the layout of a data file from its content, and reads and writes data sets.

use crate::column::{TIME, TRAJECTORY};
use crate::csv_long::{MissingCells, read_long, write_csv};
use crate::csv_source::CsvSource;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::foreign::{Content, content};
use crate::legacy_ball::read_ball;
use crate::npz::write_npz;
use crate::push::{PushError, read_push_dataset};
use crate::sniff::{RecognitionOptions, recognise, recognise_bytes};
use crate::whole_file::read_whole;
use std::path::Path;

/// Reads a data set in any layout that this crate knows.
///
/// The layouts are CSV in long form or the ball layout `traj,step,t,height,velocity`, plain or gzip; NPZ; and
/// the published push files (HDF5, JSON, a zip archive or a folder of them). Spreadsheets (`.xlsx`), JSON,
/// MATLAB, HDF5 and LabVIEW files are converted to a table of text first. Any other table of numbers is
/// read by [`recognise`](crate::recognise), which infers the meaning of its columns; [`Dataset::notes`] then
/// list the assumptions. `-` is standard input; a FIFO or `/dev/stdin` is read like any file.
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
/// Any [`DataError`] of the readers. A file with the header of the long form gets the errors of the long
/// form.
pub fn read_dataset(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    if path.is_dir() {
        return match read_push_dataset(path) {
            // A folder without published pushes may hold recordings, one trajectory per file.
            Err(no_pushes @ DataError::Push(PushError::NoPushFiles { .. })) => {
                match recognise(&[path.to_owned()], &RecognitionOptions::default(), missing) {
                    Err(DataError::NotRecognised { path: place, .. }) if place == path => Err(no_pushes),
                    result => result.map(|r| r.data),
                }
            }
            result => result,
        };
    }
    let bytes = match content(path, read_whole(path)?, missing)? {
        Content::Text(bytes) => bytes,
        Content::Data(data) => return Ok(data),
    };
    match read_strictly(path, bytes.clone(), missing) {
        Err(Refused { cause, is_long_form }) if may_be_other_layout(&cause) => {
            let result = recognise_bytes(path, bytes, missing);
            // A file with the header of the long form is reported with its error in the long form.
            result.map(|r| r.data).map_err(|e| if is_long_form { cause } else { e })
        }
        Err(Refused { cause, .. }) => Err(cause),
        Ok(data) => Ok(data),
    }
}

/// Error of a file that is neither in the long form nor in the ball layout.
struct Refused {
    cause: DataError,
    /// Whether the header of the file is that of the long form or of the ball layout.
    is_long_form: bool,
}

impl From<DataError> for Refused {
    fn from(cause: DataError) -> Self {
        Refused { cause, is_long_form: false }
    }
}

/// Reads a file in the ball layout (`traj,step,t,height,velocity`) or in long form, without inferences.
fn read_strictly(path: &Path, bytes: Vec<u8>, missing: MissingCells) -> Result<Dataset, Refused> {
    let source = CsvSource::from_bytes(path, bytes)?;
    if source.header() == ["traj", "step", "t", "height", "velocity"] {
        return read_ball(source).map_err(|cause| Refused { cause, is_long_form: true });
    }
    let is_long_form = [TRAJECTORY, TIME].iter().all(|name| source.header().iter().any(|h| h == name));
    read_long(source, missing).map_err(|cause| Refused { cause, is_long_form })
}

/// Whether a file that gives this error when read in long form may be in another layout that can be inferred.
fn may_be_other_layout(cause: &DataError) -> bool {
    matches!(
        cause,
        DataError::MissingColumn { .. }
            | DataError::UnexpectedSeparator { .. }
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

/// Reads a CSV text in long form from memory; `name` stands for the file name in messages.
///
/// # Errors
/// The errors of [`read_csv`](crate::read_csv).
pub fn read_csv_bytes(name: &str, csv: Vec<u8>, missing: MissingCells) -> Result<Dataset, DataError> {
    read_long(CsvSource::from_bytes(Path::new(name), csv)?, missing)
}

/// Writes a data set atomically, as NPZ where the name ends in `.npz`, otherwise as CSV in long form.
///
/// # Errors
/// The errors of [`write_csv`] and [`write_npz`].
pub fn write_dataset(dataset: &Dataset, path: &Path) -> Result<(), DataError> {
    match path.extension().is_some_and(|extension| extension == "npz") {
        true => write_npz(dataset, path),
        false => write_csv(dataset, path),
    }
}
