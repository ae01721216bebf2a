//! Reads all push trials in a folder, in an archive, or in one file.

use super::archive::{is_zip, members, unpack};
use super::error::PushError;
use super::trial::{PushTrial, TRIAL_COLUMNS, is_named_like_a_trial};
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::source::Source;
use crate::whole_file::read_whole;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const EXPECTED: &str = "`.h5`, `.json` or `.zip` files, named `motion_surface=…` or `block=…`";

/// Reads the push trials in `path`: an HDF5 or JSON file, a zip archive of them, or a folder.
///
/// Folders are searched recursively. Files with other extensions are skipped, and the trials are sorted by
/// file name.
///
/// # Errors
/// The first fault in any file (see [`PushError`]), a trial that occurs twice, or no trials.
pub fn read_push_trials(path: &Path) -> Result<Vec<PushTrial>, DataError> {
    let mut trials = Vec::new();
    if path.is_dir() {
        for file in files_below(path)? {
            read_file(&file, &mut trials)?;
        }
    } else {
        read_file(path, &mut trials)?;
    }
    check_trials(path, trials)
}

/// Checks that there are push trials and that none occurs twice.
fn check_trials(path: &Path, trials: Vec<PushTrial>) -> Result<Vec<PushTrial>, DataError> {
    if trials.is_empty() {
        return Err(PushError::NoPushFiles { path: path.to_owned(), expected: EXPECTED }.into());
    }
    let mut first_paths = BTreeMap::new();
    for trial in &trials {
        if let Some(first) = first_paths.insert(trial.name.to_string(), &trial.path) {
            let (first, second) = (first.clone(), trial.path.clone());
            return Err(PushError::DuplicateTrial { first, second }.into());
        }
    }
    Ok(trials)
}

/// Reads the push trials in `path` as a data set, each at the union of its streams' sample times.
///
/// See [`PushTrial::trajectory`]. The group of a trajectory is the support and the object.
///
/// # Errors
/// The errors of [`read_push_trials`], and a trial whose streams do not overlap in time.
pub fn read_push_dataset(path: &Path) -> Result<Dataset, DataError> {
    dataset(path, read_push_trials(path)?)
}

/// Like [`read_push_dataset`], for a file whose bytes were read; `path` gives the trial's name.
pub(crate) fn read_push_dataset_bytes(path: &Path, bytes: Vec<u8>) -> Result<Dataset, DataError> {
    let mut trials = Vec::new();
    add_trials(path, bytes, &mut trials)?;
    dataset(path, check_trials(path, trials)?)
}

fn dataset(path: &Path, trials: Vec<PushTrial>) -> Result<Dataset, DataError> {
    let trajectories = trials.iter().map(PushTrial::trajectory).collect::<Result<Vec<_>, _>>()?;
    let columns = TRIAL_COLUMNS.iter().map(|name| crate::Column::new(name)).collect::<Result<Vec<_>, _>>()?;
    Dataset::with_origin(columns, trajectories, Source::File(path.to_owned()))
}

fn read_file(path: &Path, trials: &mut Vec<PushTrial>) -> Result<(), DataError> {
    add_trials(path, read_whole(path)?, trials)
}

/// Adds the push trials in the bytes of a file or of an archive to `trials`.
fn add_trials(path: &Path, bytes: Vec<u8>, trials: &mut Vec<PushTrial>) -> Result<(), DataError> {
    if !is_zip(&bytes) {
        trials.push(PushTrial::from_bytes(path, bytes)?);
        return Ok(());
    }
    let mut names = members(path, &bytes)?;
    names.retain(|name| has_trial_extension(Path::new(name)) && !name.starts_with("__MACOSX/"));
    names.sort_unstable();
    unpack(path, &bytes, &names, |name, content| {
        trials.push(PushTrial::from_bytes(&path.join(name), content)?);
        Ok(())
    })
}

/// Whether a file has the extension of a trial or of an archive, and is not hidden.
fn has_trial_extension(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    !hidden && extension.is_some_and(|e| ["h5", "hdf5", "json", "zip"].contains(&e.as_str()))
}

/// Files in a folder and its subfolders that may hold trials, sorted by name.
fn files_below(folder: &Path) -> Result<Vec<PathBuf>, DataError> {
    let unreadable = |cause| DataError::Unreadable { path: folder.to_owned(), cause };
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        entries.push(entry.map_err(unreadable)?.path());
    }
    entries.sort_unstable();
    let mut files = Vec::new();
    for entry in entries {
        if entry.is_dir() {
            files.extend(files_below(&entry)?);
        } else if has_trial_extension(&entry)
            && (is_named_like_a_trial(&entry)
                || entry.extension().is_some_and(|e| e.eq_ignore_ascii_case("zip")))
        {
            files.push(entry);
        }
    }
    Ok(files)
}
