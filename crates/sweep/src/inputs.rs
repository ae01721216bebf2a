//! Input files of tasks: paths, SHA-256 hashes and glob patterns.
//!
//! Paths are relative to the folder of the sweep file, in the tasks as well. A project that is moved as
//! a whole keeps its tasks and results.

use super::fault::{InputFault, SweepFault};
use anyhow::Context;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// An input file or folder of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Path as written in the sweep file.
    pub path: String,
    /// SHA-256 of the input's content, in hexadecimal digits.
    pub sha256: String,
}

/// Returns the SHA-256 of bytes in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Expands a glob pattern into the sorted matching paths; returns an existing path as it is.
///
/// # Errors
/// The path does not exist, or no path matches the pattern.
pub fn expand(folder: &Path, text: &str) -> Result<Vec<String>, InputFault> {
    if text == "-" {
        return Err(InputFault::StandardInput);
    }
    if folder.join(text).exists() {
        return Ok(vec![text.to_owned()]);
    }
    let whole = folder.join(text);
    if !text.contains(['*', '?', '[']) {
        return Err(InputFault::Absent { path: whole });
    }
    let top = glob::Pattern::escape(&folder.to_string_lossy());
    let pattern = if Path::new(text).is_absolute() { text.to_owned() } else { format!("{top}/{text}") };
    let mut found = Vec::new();
    let paths = glob::glob(&pattern);
    for path in paths.map_err(|cause| InputFault::Pattern { path: whole.clone(), cause })? {
        let path = path.map_err(|cause| InputFault::Unreadable { path: whole.clone(), cause })?;
        let inner = path.strip_prefix(folder).unwrap_or(&path);
        let Some(inner) = inner.to_str() else {
            return Err(InputFault::NotUtf8 { pattern: whole, path });
        };
        found.push(inner.to_owned());
    }
    match found.is_empty() {
        true => Err(InputFault::NoMatch { path: whole }),
        false => Ok(found),
    }
}

/// Caches the SHA-256 of files until their size or modification time changes.
#[derive(Debug, Default)]
pub struct Hasher(Mutex<BTreeMap<PathBuf, CachedHash>>);

#[derive(Debug, Clone)]
struct CachedHash {
    bytes: u64,
    modified: Option<SystemTime>,
    sha256: String,
}

impl Hasher {
    /// Returns the SHA-256 of a file, or of the names and hashes of all files in a folder.
    ///
    /// # Errors
    /// A file cannot be read, or the path is neither a file nor a folder.
    pub fn hash(&self, path: &Path) -> anyhow::Result<String> {
        let unreadable = || format!("{}: cannot read it", path.display());
        let found = std::fs::metadata(path).with_context(unreadable)?;
        if found.is_dir() {
            return self.hash_folder(path);
        }
        if !found.is_file() {
            return Err(SweepFault::Input(InputFault::Special { path: path.to_owned() }).into());
        }
        let (bytes, modified) = (found.len(), found.modified().ok());
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner).get(path).cloned();
        if let Some(known) =
            known.filter(|k| k.bytes == bytes && k.modified == modified && modified.is_some())
        {
            return Ok(known.sha256);
        }
        let sha256 = hash_file(path).with_context(unreadable)?;
        let known = CachedHash { bytes, modified, sha256: sha256.clone() };
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned(), known);
        Ok(sha256)
    }

    fn hash_folder(&self, folder: &Path) -> anyhow::Result<String> {
        let mut files = Vec::new();
        list(folder, &mut files)?;
        files.sort();
        let mut whole = Sha256::new();
        for file in &files {
            let name = file.strip_prefix(folder).unwrap_or(file).to_string_lossy();
            // The length prefix makes the boundary between name and content unambiguous.
            whole.update((name.len() as u64).to_le_bytes());
            whole.update(name.as_bytes());
            whole.update(self.hash(file)?);
        }
        Ok(hex(&whole.finalize()))
    }
}

fn hash_file(path: &Path) -> std::io::Result<String> {
    let mut reader = BufReader::with_capacity(1 << 16, File::open(path)?);
    let mut hasher = Sha256::new();
    loop {
        let chunk = reader.fill_buf()?;
        if chunk.is_empty() {
            return Ok(hex(&hasher.finalize()));
        }
        hasher.update(chunk);
        let length = chunk.len();
        reader.consume(length);
    }
}

/// Adds the files in a folder and its subfolders to `files`.
///
/// Links to folders are not followed, so cycles are impossible.
fn list(folder: &Path, files: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let unreadable = || format!("{}: cannot read the folder", folder.display());
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let entry = entry.with_context(unreadable)?;
        let (path, kind) = (entry.path(), entry.file_type().with_context(unreadable)?);
        if kind.is_dir() {
            list(&path, files)?;
        } else if path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}
