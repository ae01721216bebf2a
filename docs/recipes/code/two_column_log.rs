//! `two-column-log`: one file a drop, `milliseconds millimetres` in each line, `#` before remarks.

use super::Converted;
use crate::{DataError, Dataset, Trajectory, read_text};
use std::path::{Path, PathBuf};

/// Gravity alone, and a ball that is let go somewhere in the first sample.
const MODEL: &str = "\
scenario = \"ball\"

[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }

[release]
kind = \"free\"
";

/// Reads every `.log` of a folder, in the order of their names: `height_m` against `t_s`.
///
/// # Errors
/// [`DataError`] with file, line and column.
pub fn convert(folder: &Path) -> Result<Converted, DataError> {
    let unreadable = |cause| DataError::Unreadable { path: folder.to_owned(), cause };
    let entries = std::fs::read_dir(folder).map_err(unreadable)?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "log"));
    files.sort();
    let drops = files.iter().map(|path| drop_of(path)).collect::<Result<Vec<_>, _>>()?;
    let data = Dataset::from_names(&["height_m"], drops)?;
    Ok(Converted { data, model_toml: Some(MODEL.to_owned()) })
}

fn drop_of(path: &Path) -> Result<Trajectory, DataError> {
    let text = read_text(path).map_err(|cause| DataError::Unreadable { path: path.to_owned(), cause })?;
    let (mut times, mut heights) = (Vec::new(), Vec::new());
    for (number, line) in (1u64..).zip(text.lines()) {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let mut cells = line.split_whitespace();
        for (column, into) in [("milliseconds", &mut times), ("millimetres", &mut heights)] {
            let cell = cells.next().unwrap_or_default();
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            let value = value.ok_or_else(|| DataError::BadNumber {
                path: path.to_owned(),
                line: number,
                column: column.to_owned(),
                cell: cell.to_owned(),
            })?;
            into.push(value / 1e3);
        }
    }
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    Trajectory::new(name, times, vec![heights])
}
