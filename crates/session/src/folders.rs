//! Creates output folders, and removes the empty ones that this process created when it ends.

use crate::Usage;
use crate::usage::PathFault;
use anyhow::Context;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Folders that this process created, parents first.
static MADE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Creates a folder and its missing parents.
///
/// # Errors
/// A part of the path is a file, or the folder cannot be created.
pub fn make(folder: &Path) -> anyhow::Result<()> {
    let mut absent = Vec::new();
    for outer in folder.ancestors().filter(|p| !p.as_os_str().is_empty()) {
        match std::fs::metadata(outer) {
            Ok(found) if found.is_dir() => break,
            Ok(_) => return Err(not_a_folder(outer)),
            Err(_) => absent.push(outer),
        }
    }
    for folder in absent.into_iter().rev() {
        let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
        match std::fs::create_dir(folder) {
            Ok(()) => made.push(folder.to_owned()),
            // Another process may have created it in between.
            Err(e) if e.kind() == ErrorKind::AlreadyExists && folder.is_dir() => {}
            // A file in the path is found above only if its metadata may be read.
            Err(e) if matches!(e.kind(), ErrorKind::AlreadyExists | ErrorKind::NotADirectory) => {
                return Err(not_a_folder(folder));
            }
            Err(e) => {
                return Err(e).with_context(|| format!("{}: cannot create the folder", folder.display()));
            }
        }
    }
    Ok(())
}

/// Returns the folder of a file; `.` for a bare file name.
pub fn parent_of(file: &Path) -> &Path {
    file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes the folders that this process created and that are empty.
pub fn remove_empty() {
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    while let Some(folder) = made.pop() {
        // Fails if the folder is not empty, as intended.
        let _ = std::fs::remove_dir(folder);
    }
}

fn not_a_folder(path: &Path) -> anyhow::Error {
    Usage::path(path, PathFault::NotAFolder).into()
}
