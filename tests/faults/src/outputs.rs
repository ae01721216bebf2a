//! The files of a command: whole or absent, and the same as those of an undisturbed run.

use anyhow::Context;
use augsim_data::{MissingCells, read_dataset};
use augsim_nn::checkpoint;
use augsim_trainer::TrainingState;
use safetensors::SafeTensors;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Run times differ from run to run; every other file depends on the seed and on the inputs alone.
const TIMES: &str = "timing.json";

/// The files below a folder, by their paths in it.
pub type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Everything below `folder`, which may be absent.
///
/// # Errors
/// Something cannot be read.
pub fn files(folder: &Path) -> anyhow::Result<Files> {
    let mut files = Files::new();
    if folder.is_dir() {
        gather(folder, folder, &mut files)?;
    }
    Ok(files)
}

fn gather(root: &Path, folder: &Path, files: &mut Files) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            gather(root, &path, files)?;
        } else {
            let content = fs::read(&path).with_context(|| path.display().to_string())?;
            files.insert(path.strip_prefix(root)?.to_owned(), content);
        }
    }
    Ok(())
}

/// Whether a file is a temporary one, which a killed process may leave: hidden, and ending in `.tmp`.
fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// Whether a file only guards its folder (a lock is empty, or names a process).
fn is_lock(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "lock")
}

/// Whether a file is a result or a step towards one.
pub fn is_kept(path: &Path) -> bool {
    !is_temporary(path) && !is_lock(path)
}

/// The first file below `folder` that is neither whole nor temporary: a file is whole if it equals that of an
/// undisturbed run, or if its format can be read to the end.
///
/// # Errors
/// Something cannot be read at all.
pub fn damage(folder: &Path, undisturbed: &Files) -> anyhow::Result<Option<String>> {
    for (path, content) in files(folder)? {
        if !is_kept(&path) || undisturbed.get(&path) == Some(&content) {
            continue;
        }
        if let Err(fault) = readable(&folder.join(&path), &content) {
            return Ok(Some(format!("{} is no whole file: {fault:#}", path.display())));
        }
    }
    Ok(None)
}

fn readable(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    match extension.as_str() {
        "bin" => drop(checkpoint::load::<TrainingState>(path)?),
        "safetensors" => drop(SafeTensors::deserialize(content)?),
        "toml" => drop(toml::from_str::<toml::Table>(std::str::from_utf8(content)?)?),
        "json" => drop(serde_json::from_slice::<serde_json::Value>(content)?),
        "jsonl" => {
            anyhow::ensure!(content.is_empty() || content.ends_with(b"\n"), "its last line is cut");
            for line in std::str::from_utf8(content)?.lines() {
                drop(serde_json::from_str::<serde_json::Value>(line)?);
            }
        }
        "html" => anyhow::ensure!(content.trim_ascii_end().ends_with(b"</html>"), "it has no end"),
        "csv" => {
            anyhow::ensure!(content.ends_with(b"\n"), "its last line is cut");
            drop(read_dataset(path, MissingCells::AsGap)?);
        }
        _ => anyhow::bail!("{name} is of no kind that augsim writes"),
    }
    Ok(())
}

/// The first difference between the files below `folder` and those of an undisturbed run; what is temporary must be gone.
///
/// # Errors
/// Something cannot be read.
pub fn difference(folder: &Path, undisturbed: &Files) -> anyhow::Result<Option<String>> {
    let found = files(folder)?;
    let timed = |path: &Path| path.file_name().is_some_and(|name| name == TIMES);
    for (path, content) in &found {
        match undisturbed.get(path) {
            None => return Ok(Some(format!("{} is left over", path.display()))),
            Some(expected) if expected != content && !timed(path) => {
                return Ok(Some(format!("{} has other bytes", path.display())));
            }
            Some(_) => {}
        }
    }
    let absent = undisturbed.keys().find(|path| !found.contains_key(*path));
    Ok(absent.map(|path| format!("{} is missing", path.display())))
}
