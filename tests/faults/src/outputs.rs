//! Checks the output files of a command for damage and for differences from an undisturbed run.

use anyhow::Context;
use augsim_data::{MissingCells, read_dataset};
use augsim_nn::checkpoint;
use augsim_trainer::TrainingState;
use safetensors::SafeTensors;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the file of run times; only this file differs between runs with the same seed and inputs.
const TIMING_FILE: &str = "timing.json";

/// Contents of all files below a folder, by path relative to the folder.
pub type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Reads all files below `folder`, which may be absent.
///
/// # Errors
/// A file cannot be read.
pub fn files(folder: &Path) -> anyhow::Result<Files> {
    let mut files = Files::new();
    if folder.is_dir() {
        collect_files(folder, folder, &mut files)?;
    }
    Ok(files)
}

/// Adds the files below `folder` to `files`, with their paths relative to `root`.
fn collect_files(root: &Path, folder: &Path, files: &mut Files) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect_files(root, &path, files)?;
        } else {
            let content = fs::read(&path).with_context(|| path.display().to_string())?;
            files.insert(path.strip_prefix(root)?.to_owned(), content);
        }
    }
    Ok(())
}

/// Whether a file is temporary (hidden, ending in `.tmp`); a killed process may leave such files.
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// Describes the first file below `folder` that is neither complete nor temporary.
///
/// A file is complete if it equals that of an undisturbed run, or if its format can be read to the end.
///
/// # Errors
/// A file cannot be opened.
pub fn damage(folder: &Path, undisturbed: &Files) -> anyhow::Result<Option<String>> {
    for (path, content) in files(folder)? {
        if is_temporary(&path) || undisturbed.get(&path) == Some(&content) {
            continue;
        }
        if let Err(fault) = check_readable(&folder.join(&path), &content) {
            return Ok(Some(format!("{} is not a complete file: {fault:#}", path.display())));
        }
    }
    Ok(None)
}

/// Reads a file of a known format to the end; returns an error if that fails.
fn check_readable(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    match extension.as_str() {
        "bin" => drop(checkpoint::load::<TrainingState>(path)?),
        "safetensors" => drop(SafeTensors::deserialize(content)?),
        "toml" => drop(toml::from_str::<toml::Table>(std::str::from_utf8(content)?)?),
        "json" => drop(serde_json::from_slice::<serde_json::Value>(content)?),
        "jsonl" => {
            anyhow::ensure!(content.is_empty() || content.ends_with(b"\n"), "its last line is incomplete");
            for line in std::str::from_utf8(content)?.lines() {
                drop(serde_json::from_str::<serde_json::Value>(line)?);
            }
        }
        "html" => anyhow::ensure!(content.trim_ascii_end().ends_with(b"</html>"), "its end is missing"),
        "csv" => {
            anyhow::ensure!(content.ends_with(b"\n"), "its last line is incomplete");
            drop(read_dataset(path, MissingCells::AsGap)?);
        }
        _ => anyhow::bail!("{name} is not a kind of file that augsim writes"),
    }
    Ok(())
}

/// Describes the first difference between the files below `folder` and those of an undisturbed run.
///
/// Temporary files count as differences.
///
/// # Errors
/// A file cannot be read.
pub fn difference(folder: &Path, undisturbed: &Files) -> anyhow::Result<Option<String>> {
    let found = files(folder)?;
    let is_timing = |path: &Path| path.file_name().is_some_and(|name| name == TIMING_FILE);
    for (path, content) in &found {
        match undisturbed.get(path) {
            None => return Ok(Some(format!("{} is unexpected", path.display()))),
            Some(expected) if expected != content && !is_timing(path) => {
                return Ok(Some(format!("{} has different bytes", path.display())));
            }
            Some(_) => {}
        }
    }
    let absent = undisturbed.keys().find(|path| !found.contains_key(*path));
    Ok(absent.map(|path| format!("{} is missing", path.display())))
}

#[cfg(test)]
mod tests {
    //! Contract: a truncated file, an unexpected file and different bytes are noticed. A complete file from
    //! an earlier moment of the run and the temporary file of a killed process are accepted. A harness that
    //! accepts everything would always pass.
    use super::*;

    fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            fs::write(folder.path().join(name), content).unwrap();
        }
        folder
    }

    #[test]
    fn a_truncated_file_is_noticed_in_every_format() {
        for (name, content) in [
            ("result.json", b"{\"schema\": ".as_slice()),
            ("model.toml", b"scenario = \"ba"),
            ("weights.safetensors", b""),
            ("checkpoint.bin", b"augsim"),
            ("metrics.jsonl", b"{}\n{\"loss\": "),
            ("forecast.csv", b"trajectory,t_s,height_m\na,0,4."),
            ("report.html", b"<html><body>"),
            ("strange", b"anything"),
        ] {
            let folder = folder(&[(name, content)]);
            let found = damage(folder.path(), &Files::new()).unwrap();
            assert!(found.is_some_and(|text| text.contains(name)), "{name}");
        }
    }

    #[test]
    fn complete_and_temporary_files_are_not_damage() {
        let folder =
            folder(&[("result.json", b"{}"), (".result.json.17-0.tmp", b"{\"half"), ("strange", b"same")]);
        let undisturbed = Files::from([("strange".into(), b"same".to_vec())]);
        assert_eq!(damage(folder.path(), &undisturbed).unwrap(), None);
    }

    #[test]
    fn changed_unexpected_and_missing_files_are_differences_but_run_times_are_not() {
        let undisturbed =
            Files::from([("result.json".into(), b"{}".to_vec()), (TIMING_FILE.into(), b"1".to_vec())]);
        let difference = |files: &[(&str, &[u8])]| difference(folder(files).path(), &undisturbed).unwrap();
        assert_eq!(difference(&[("result.json", b"{}"), (TIMING_FILE, b"2")]), None);
        for (files, text) in [
            ([("result.json", b"[]".as_slice()), (TIMING_FILE, b"1")], "different bytes"),
            ([("result.json", b"{}"), (".x.tmp", b"")], "unexpected"),
        ] {
            assert!(difference(&files).is_some_and(|found| found.contains(text)), "{text}");
        }
        assert!(difference(&[(TIMING_FILE, b"1")]).is_some_and(|found| found.contains("missing")));
    }
}
