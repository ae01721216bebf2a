//! Folders that this process makes; those that stay empty are removed when it ends.

use crate::Usage;
use crate::usage::PathFault;
use anyhow::Context;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Folders that this process made, outer ones first.
static MADE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Makes a folder and those around it that are absent.
///
/// # Errors
/// The path leads through a file, or the system refuses.
pub fn make(folder: &Path) -> anyhow::Result<()> {
    let mut absent = Vec::new();
    for outer in folder.ancestors().filter(|p| !p.as_os_str().is_empty()) {
        match std::fs::metadata(outer) {
            Ok(found) if found.is_dir() => break,
            Ok(_) => return Err(is_no_folder(outer)),
            Err(_) => absent.push(outer),
        }
    }
    for folder in absent.into_iter().rev() {
        let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
        match std::fs::create_dir(folder) {
            Ok(()) => made.push(folder.to_owned()),
            // Another process may have made it in between.
            Err(e) if e.kind() == ErrorKind::AlreadyExists && folder.is_dir() => {}
            // Of a path that leads through a file, the file itself was seen above only if it may be looked at.
            Err(e) if matches!(e.kind(), ErrorKind::AlreadyExists | ErrorKind::NotADirectory) => {
                return Err(is_no_folder(folder));
            }
            Err(e) => return Err(e).with_context(|| format!("{}: cannot make the folder", folder.display())),
        }
    }
    Ok(())
}

/// The folder that a file is in.
pub fn around(file: &Path) -> &Path {
    file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes the folders that this process made and that are empty.
pub fn remove_empty() {
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    while let Some(folder) = made.pop() {
        // Fails where something is in it, as it should.
        let _ = std::fs::remove_dir(folder);
    }
}

fn is_no_folder(path: &Path) -> anyhow::Error {
    Usage::path(path, PathFault::NoFolder).into()
}
