//! Reads a trial from HDF5: one two-dimensional data set of doubles per stream.

use super::error::PushError;
use super::fault::{FilePart, StreamLayout};
use crate::limits::Limit;
use hdf5_reader::error::Error;
use hdf5_reader::{Hdf5File, OpenOptions};
use std::path::Path;

/// Size of a row of a sensor stream (four doubles), bytes.
const ROW_BYTES: u64 = 32;

/// Reads the rows (time and three values) of the sensor streams `keys` from an HDF5 file.
pub(super) fn rows<const N: usize>(
    path: &Path,
    bytes: Vec<u8>,
    keys: [&'static str; N],
) -> Result<[Vec<[f64; 4]>; N], PushError> {
    let damaged = |key: &str| {
        let (path, key) = (path.to_owned(), key.to_owned());
        move |cause| PushError::Hdf5 { path, key, cause: Box::new(cause) }
    };
    let max_bytes = usize::try_from(Limit::Samples.value().saturating_mul(ROW_BYTES)).unwrap_or(usize::MAX);
    let options = OpenOptions::default().with_max_read_bytes(max_bytes);
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(damaged("/"))?;
    let mut streams: [Vec<[f64; 4]>; N] = std::array::from_fn(|_| Vec::new());
    for (rows, key) in streams.iter_mut().zip(keys) {
        let stream = match file.dataset(key) {
            Ok(stream) => stream,
            Err(cause) if is_not_found(&cause) => {
                let (_, members) = file.root_group().and_then(|g| g.members()).map_err(damaged("/"))?;
                let found = members.iter().map(|member| member.name().to_owned()).collect();
                return Err(PushError::MissingStream { path: path.to_owned(), key, found });
            }
            Err(cause) => return Err(damaged(key)(cause)),
        };
        let layout = |found: StreamLayout| PushError::Layout { path: path.to_owned(), key, found };
        let [count, 4] = *stream.shape() else {
            return Err(layout(StreamLayout::Shape { shape: stream.shape().to_vec() }));
        };
        // A header of a few bytes can state any shape, and HDF5 fills in rows that are not stored.
        Limit::Samples.check(count).map_err(|cause| PushError::Limit {
            path: path.to_owned(),
            part: FilePart::Stream(key),
            cause,
        })?;
        let cells = match stream.read_array::<f64>() {
            Ok(cells) => cells,
            Err(Error::Context { source, .. }) if matches!(*source, Error::TypeMismatch { .. }) => {
                return Err(layout(StreamLayout::Type));
            }
            Err(cause) => return Err(damaged(key)(cause)),
        };
        rows.extend(cells.outer_iter().map(|row| [row[0], row[1], row[2], row[3]]));
    }
    Ok(streams)
}

/// Whether an HDF5 error means that a data set does not exist.
fn is_not_found(error: &Error) -> bool {
    match error {
        Error::DatasetNotFound(_) => true,
        Error::Context { source, .. } => is_not_found(source),
        _ => false,
    }
}
