//! `run.toml`: which command, with which settings, on which inputs, made what is in a folder.

use anyhow::Context;
use augsim_data::atomic_write;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;

/// Name of the file.
pub const RECORD: &str = "run.toml";

/// Stands for the content of a pipe, which cannot be looked at twice.
const STREAM: &str = "a stream";

/// Everything that decides the results in a folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of augsim: another may give other results.
    pub augsim: String,
    /// The command.
    pub command: String,
    /// Its settings.
    pub settings: BTreeMap<String, String>,
    /// Fingerprints of the content of its inputs; paths do not matter.
    pub inputs: BTreeMap<String, String>,
}

impl Record {
    /// Of a command without settings.
    pub fn new(command: &str) -> Self {
        Record {
            augsim: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            settings: BTreeMap::new(),
            inputs: BTreeMap::new(),
        }
    }

    /// With a setting.
    pub fn setting(mut self, name: &str, value: impl ToString) -> Self {
        self.settings.insert(name.to_owned(), value.to_string());
        self
    }

    /// With the content of a file or a folder.
    pub fn input(mut self, name: &str, path: &Path) -> Self {
        self.inputs.insert(name.to_owned(), fingerprint(path));
        self
    }

    /// The record in a folder, if there is one.
    ///
    /// # Errors
    /// It cannot be read or is none.
    pub fn read(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join(RECORD);
        match std::fs::read_to_string(&path) {
            Ok(text) => toml::from_str(&text)
                .map(Some)
                .with_context(|| format!("{}: not the record of a run of augsim", path.display())),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e).with_context(|| format!("{}: cannot read it", path.display())),
        }
    }

    /// Writes it into a folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let text = toml::to_string_pretty(self)?;
        atomic_write(&folder.join(RECORD), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// The first thing that differs from the record that is there; `None` where the results must be the same.
    pub fn difference(&self, there: &Self) -> Option<String> {
        let differ = |name: &str, there: &str, here: &str| format!("{name} is {there} there and {here} here");
        if self.command != there.command {
            return Some(differ("the command", &there.command, &self.command));
        }
        let none = "absent".to_owned();
        for (ours, theirs, kind) in
            [(&self.settings, &there.settings, ""), (&self.inputs, &there.inputs, "the content of ")]
        {
            let mut names: Vec<&String> = ours.keys().chain(theirs.keys()).collect();
            names.sort_unstable();
            for name in names {
                let [here, there] = [ours, theirs].map(|map| map.get(name).unwrap_or(&none));
                if here != there || here == STREAM {
                    return Some(differ(&format!("{kind}{name}"), there, here));
                }
            }
        }
        (self.augsim != there.augsim).then(|| differ("the version of augsim", &there.augsim, &self.augsim))
    }
}

/// The content of a file in a few characters (CRC-32 and size); of a folder, the names and sizes of its files. A file that
/// cannot be read gets its sentence from the reader of its format.
pub fn fingerprint(path: &Path) -> String {
    match std::fs::metadata(path) {
        Ok(found) if found.is_file() => match checksum(path) {
            Ok((hash, bytes)) => format!("crc32:{hash:08x} of {bytes} bytes"),
            Err(_) => "unreadable".to_owned(),
        },
        Ok(found) if found.is_dir() => {
            let mut files = Vec::new();
            list(path, path, &mut files);
            files.sort_unstable();
            let mut hasher = crc32fast::Hasher::new();
            for (name, bytes) in &files {
                hasher.update(name.as_bytes());
                hasher.update(&bytes.to_le_bytes());
            }
            format!("crc32:{:08x} of the names and sizes of {} files", hasher.finalize(), files.len())
        }
        Ok(_) => STREAM.to_owned(),
        Err(_) => "unreadable".to_owned(),
    }
}

fn checksum(path: &Path) -> std::io::Result<(u32, u64)> {
    let mut reader = BufReader::with_capacity(1 << 16, File::open(path)?);
    let mut hasher = crc32fast::Hasher::new();
    let mut bytes = 0;
    loop {
        let chunk = reader.fill_buf()?;
        if chunk.is_empty() {
            return Ok((hasher.finalize(), bytes));
        }
        hasher.update(chunk);
        let length = chunk.len();
        bytes += length as u64;
        reader.consume(length);
    }
}

/// Collects the files below `folder` by their path from `top`; links to folders are not followed, so that no circle is.
fn list(top: &Path, folder: &Path, files: &mut Vec<(String, u64)>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => list(top, &path, files),
            _ => {
                let name = path.strip_prefix(top).unwrap_or(&path).to_string_lossy().into_owned();
                files.push((name, std::fs::metadata(&path).map_or(0, |m| m.len())));
            }
        }
    }
}

/// A path of a page: one inside the folder of the results does not depend on where that is.
pub fn shown(path: &Path, out: &Path) -> String {
    let inside = path.strip_prefix(out);
    inside.map_or_else(|_| path.display().to_string(), |inside| format!("DIR/{}", inside.display()))
}
