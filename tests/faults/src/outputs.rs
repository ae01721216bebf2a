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
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// The first file below `folder` that is neither whole nor temporary: a file is whole if it equals that of an
/// undisturbed run, or if its format can be read to the end.
///
/// # Errors
/// Something cannot be read at all.
pub fn damage(folder: &Path, undisturbed: &Files) -> anyhow::Result<Option<String>> {
    for (path, content) in files(folder)? {
        if is_temporary(&path) || undisturbed.get(&path) == Some(&content) {
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

#[cfg(test)]
mod tests {
    //! Contract: a file that was cut, a left-over and other bytes are noticed; a file of another moment that is whole,
    //! and the temporary file of a killed process, are none. A harness that accepts everything would pass for ever.
    use super::*;

    fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            fs::write(folder.path().join(name), content).unwrap();
        }
        folder
    }

    #[test]
    fn a_cut_file_is_noticed_in_every_format() {
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
    fn whole_files_and_temporary_ones_are_no_damage() {
        let folder =
            folder(&[("result.json", b"{}"), (".result.json.17-0.tmp", b"{\"half"), ("strange", b"same")]);
        let undisturbed = Files::from([("strange".into(), b"same".to_vec())]);
        assert_eq!(damage(folder.path(), &undisturbed).unwrap(), None);
    }

    #[test]
    fn other_bytes_a_left_over_and_a_missing_file_are_differences_and_times_are_none() {
        let undisturbed =
            Files::from([("result.json".into(), b"{}".to_vec()), (TIMES.into(), b"1".to_vec())]);
        let difference = |files: &[(&str, &[u8])]| difference(folder(files).path(), &undisturbed).unwrap();
        assert_eq!(difference(&[("result.json", b"{}"), (TIMES, b"2")]), None);
        for (files, text) in [
            ([("result.json", b"[]".as_slice()), (TIMES, b"1")], "other bytes"),
            ([("result.json", b"{}"), (".x.tmp", b"")], "left over"),
        ] {
            assert!(difference(&files).is_some_and(|found| found.contains(text)), "{text}");
        }
        assert!(difference(&[(TIMES, b"1")]).is_some_and(|found| found.contains("missing")));
    }
}
