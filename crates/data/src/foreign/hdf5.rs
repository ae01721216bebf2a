//! Reads the vectors and matrices at the root of an HDF5 file and in its groups.

use super::kind::ForeignKind;
use super::{NamedVectors, check_cells, damaged, refused};
use crate::error::DataError;
use crate::limits::Limit;
use crate::sniff::Unrecognised;
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Hdf5File, OpenOptions};
use std::path::Path;

const FORMAT: &str = "an HDF5 file";
/// Maximum depth of nested HDF5 groups that are searched for vectors.
const MAX_DEPTH: usize = 4;

/// Whether the HDF5 file holds a published push trial (a member called `tip_pose`, for example).
pub(super) fn holds_a_trial(bytes: &[u8]) -> bool {
    let members = || -> Option<bool> {
        let (_, members) = Hdf5File::from_vec(bytes.to_vec()).ok()?.root_group().ok()?.members().ok()?;
        Some(members.iter().any(|m| ["tip_pose", "object_pose", "ft_wrench"].contains(&m.name())))
    };
    members().unwrap_or(false)
}

/// Converts the numeric vectors and matrices of an HDF5 file to CSV text.
///
/// # Errors
/// The file is damaged, or has no vectors of numbers.
pub(super) fn text(path: &Path, bytes: Vec<u8>) -> Result<Vec<u8>, DataError> {
    let max_bytes = usize::try_from(Limit::Bytes.value()).unwrap_or(usize::MAX);
    let options = OpenOptions::default().with_max_read_bytes(max_bytes);
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(|e| damaged(path, FORMAT, e))?;
    let root = file.root_group().map_err(|e| damaged(path, FORMAT, e))?;
    let mut out = NamedVectors::default();
    collect(path, &root, "", 0, &mut out)?;
    if out.vectors.is_empty() {
        return Err(refused(path, Unrecognised::Format { kind: ForeignKind::HDF5 }));
    }
    out.text(path, FORMAT)
}

fn collect(
    path: &Path,
    group: &Group,
    prefix: &str,
    depth: usize,
    out: &mut NamedVectors,
) -> Result<(), DataError> {
    let (groups, members) = group.members().map_err(|e| damaged(path, FORMAT, e))?;
    for member in &members {
        check_cells(path, member.shape().iter().product::<u64>())?;
        let (rows, columns) = match *member.shape() {
            [rows] => (rows, 1),
            [rows, columns] => (rows, columns),
            _ => continue,
        };
        let Some(values) = numbers(member) else { continue };
        let (rows, columns) = (rows as usize, columns as usize);
        // HDF5 stores matrices row by row.
        let by_column = (0..columns).flat_map(|c| (0..rows).map(move |r| r * columns + c));
        let values: Vec<f64> = by_column.filter_map(|k| values.get(k).copied()).collect();
        out.add(&format!("{prefix}{}", member.name()), rows, columns, &values);
    }
    if depth < MAX_DEPTH {
        for child in &groups {
            collect(path, child, &format!("{prefix}{}_", child.name()), depth + 1, out)?;
        }
    }
    Ok(())
}

/// Elements of an HDF5 data set as floating-point numbers; `None` for types other than numbers.
fn numbers(member: &Dataset) -> Option<Vec<f64>> {
    if let Ok(cells) = member.read_array::<f64>() {
        return Some(cells.iter().copied().collect());
    }
    if let Ok(cells) = member.read_array::<f32>() {
        return Some(cells.iter().map(|v| f64::from(*v)).collect());
    }
    if let Ok(cells) = member.read_array::<i64>() {
        return Some(cells.iter().map(|v| *v as f64).collect());
    }
    let cells = member.read_array::<i32>().ok()?;
    Some(cells.iter().map(|v| f64::from(*v)).collect())
}
