//! Inputs of tasks: files and folders by path and SHA-256, patterns of paths.
//!
//! Paths are relative to the folder of `SWEEP.toml`, and so they stand in the tasks: a project that is moved as a whole
//! keeps its tasks and their results.

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

/// An input of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Path as it was written.
    pub path: String,
    /// SHA-256 of its content, in hexadecimal digits.
    pub sha256: String,
}

/// Hexadecimal digits of the SHA-256 of some bytes.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The paths that a text stands for: itself, or those that match it as a pattern, in order.
///
/// # Errors
/// Nothing is there, or no path matches.
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

/// Remembers the SHA-256 of each file for as long as its size and its time stay.
#[derive(Debug, Default)]
pub struct Hasher(Mutex<BTreeMap<PathBuf, Known>>);

#[derive(Debug, Clone)]
struct Known {
    bytes: u64,
    modified: Option<SystemTime>,
    sha256: String,
}

impl Hasher {
    /// SHA-256 of a file's bytes, or of the names and SHA-256 of all files in a folder.
    ///
    /// # Errors
    /// Something cannot be read, or is neither file nor folder.
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
        let known = Known { bytes, modified, sha256: sha256.clone() };
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
            // Lengths keep one name and content from reading as another name and content.
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

/// Collects the files below a folder; links to folders are not followed, so that no circle is.
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
